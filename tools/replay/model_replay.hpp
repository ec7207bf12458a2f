// Matches a recording with a model and prints or compares the results.
#pragma once

#include "tools/replay/replay_settings.hpp"

namespace lbea::tool {

struct ModelReplayOptions {
  SettingsOptions settings;
  std::string output;
  unsigned threads = 1;
  bool compares = false, json = false;
  double tolerance = 0;
};

/// Prints the results of a part, or with `compares` their differences; false when there are any. Throws Error when
/// there is nothing to compare.
[[nodiscard]] bool replay_into_model(RecordedRun& run, const Part& part, const ModelReplayOptions& options);

}  // namespace lbea::tool
