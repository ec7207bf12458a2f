// lbea-record between rigs and their matcher: records frames and forwards them byte for byte.
#pragma once

#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/recording/recording_options.hpp"
#include "tools/shared/recording/rig_settings.hpp"

namespace lbea::tool {

struct RecordOptions {
  RigOptions rig_options;
  std::vector<std::string> forward;  // with several rigs: NAME=ENDPOINT
  std::string results_endpoint;
  std::vector<NamedRig> rigs;                    // one or several; set by read_rigs()
  std::vector<std::string> forward_endpoints{};  // one per rig, or none
  RecordingOptions recording;
  ServerAccessOptions server_access;
  ClientAccessOptions matcher_access;
  std::uint32_t max_points = wire::WireLimits{}.max_points;
  bool json = false;
};

/// Sets the rigs and their endpoints. Throws WrongUsage when the options of the rigs do not fit together.
void read_rigs(RecordOptions& options);

/// Records until a stop signal and prints the tally. Returns the exit code.
int record(RecordOptions options);

}  // namespace lbea::tool
