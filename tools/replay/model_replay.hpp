// A recording into a model, from the command line's point of view.
#pragma once

#include "tools/recording/recorded_run.hpp"

#include <string>

namespace lbea {

struct ModelReplayOptions {
  std::string recording, model_file, pose_file, output;
  unsigned threads = 1;
  bool compares = false, json = false;
  bool is_part = false;  // of the recording: results of other frames are not missed
  double tolerance = 0;
};

/// Prints the results, or with `compares` how they differ; false when they do. `run` stands at its begin.
bool replay_into_model(RecordedRun& run, const ModelReplayOptions& options);

}  // namespace lbea
