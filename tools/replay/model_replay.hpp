// A recording into a model, from the command line's point of view.
#pragma once

#include "tools/replay/part.hpp"
#include "tools/replay/replay_settings.hpp"

#include <string>

namespace lbea::tool {

struct ModelReplayOptions {
  SettingsOptions settings;
  std::string output;
  unsigned threads = 1;
  bool compares = false, json = false;
  double tolerance = 0;
};

/// Prints the results of a part, or with `compares` how they differ; false when they do. Throws Error when there is
/// nothing to compare.
[[nodiscard]] bool replay_into_model(RecordedRun& run, const Part& part, const ModelReplayOptions& options);

}  // namespace lbea::tool
