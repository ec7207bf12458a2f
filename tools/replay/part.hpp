// Which part of a recording is played.
#pragma once

#include "tools/shared/recording/recorded_run.hpp"

#include <limits>
#include <string>

namespace lbea::tool {

/// Frames received from one time to another, both included.
struct Part {
  std::int64_t from_ns = std::numeric_limits<std::int64_t>::min(), to_ns = std::numeric_limits<std::int64_t>::max();
  bool is_whole = true;
};

/// --range FROM:TO, in seconds after the first frame; all when empty. Throws WrongUsage.
struct Range {
  explicit Range(const std::string& text);
  std::string text;
  double from_s, to_s;
};

/// `run` is left unlimited, somewhere. Throws Error{bad_input} when no frame is there.
[[nodiscard]] Part part_of(RecordedRun& run, const Range& range, const std::string& file);
/// When the first frame was received of those of one session in a row amid which the part begins: a test's history.
[[nodiscard]] std::int64_t history_of(RecordedRun& run, const Part& part);

}  // namespace lbea::tool
