// lbea-record between a rig and its matcher: records frames and forwards them byte for byte.
#pragma once

#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/recording/recording_options.hpp"

namespace lbea::tool {

struct RecordOptions {
  std::string frames_endpoint, forward_endpoint, results_endpoint;
  RecordingOptions recording;
  ServerAccessOptions server_access;
  ClientAccessOptions matcher_access;
  std::uint32_t max_points = wire::WireLimits{}.max_points;
  bool json = false;
};

/// Records until a stop signal and prints the tally. Returns the exit code.
int record(const RecordOptions& options);

}  // namespace lbea::tool
