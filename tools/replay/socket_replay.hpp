// Sends recorded frames to a matcher's sockets, as cameras would.
#pragma once

#include "tools/replay/pace.hpp"
#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/recording/recorded_run.hpp"

namespace lbea::tool {

struct SocketReplayOptions {
  std::vector<std::string> to;   // endpoints; with several rigs NAME=ENDPOINT
  std::string results_endpoint;  // without it there is no receipt
  ClientAccessOptions access;
  PaceOptions pace;
  std::uint64_t rounds = 1;  // 0: until stopped; later rounds have new sessions
  bool ends_stream = true;   // announce the ends of tests, also after the last frame
  bool json = false;
};

/// Sends the remaining frames of `run` with their recorded sessions and ids, each rig's to its own endpoint, and prints
/// the tally. False when a frame was lost or the replay was stopped. Throws WrongUsage unless each rig of the recording
/// has an endpoint, and Error{bad_config | bad_input | endpoint_unavailable}.
[[nodiscard]] bool replay_to_socket(RecordedRun& run, const SocketReplayOptions& options);

}  // namespace lbea::tool
