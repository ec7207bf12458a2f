// What to replay: the part of the recording; and its replay into a model.
#pragma once

#include "tools/shared/replaying/frame_fates.hpp"
#include "tools/shared/replaying/match_settings.hpp"

namespace lbea::tool {

/// Frames received from from_ns to to_ns, inclusive.
struct Part {
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::min(), to_ns = std::numeric_limits<std::int64_t>::max();
  bool is_whole = true;
};

/// --range FROM:TO in seconds after the first frame; empty: everything. Throws WrongUsage.
struct Range {
  explicit Range(const std::string& text);
  std::string text;
  double from_s, to_s;
};

/// Moves `run` and removes its limits. Throws Error{bad_input} when the range contains no frame.
[[nodiscard]] Part part_of(RecordedRun& run, const Range& range, const std::string& file);
/// When the test in which the part begins started: the time of its first frame that was not dropped.
[[nodiscard]] std::int64_t history_of(RecordedRun& run, const Part& part, const FrameFates& fates);

struct ModelReplayOptions {
  SettingsOptions settings;              // model_file: the first
  std::vector<std::string> model_files;  // one per component
  std::string output;
  unsigned threads = 1;
  bool compares = false, json = false;
  double tolerance = 0;
};

/// Prints the results of a part, or with `compares` their differences; false when there are any. Throws Error when
/// there is nothing to compare.
[[nodiscard]] bool replay_into_model(RecordedRun& run, const Part& part, const ModelReplayOptions& options);

}  // namespace lbea::tool
