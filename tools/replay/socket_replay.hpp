// Sends recorded frames to a matcher's socket, as a camera would.
#pragma once

#include "tools/shared/intake/access_options.hpp"
#include "tools/shared/recording/recorded_run.hpp"

namespace lbea::tool {

struct SocketReplayOptions {
  std::string endpoint, results_endpoint;  // without the latter there is no receipt
  ClientAccessOptions access;
  double speed = 1;                  // relative to the recording
  bool fast = false, steps = false;  // as fast as possible; one frame per line on standard input. Both wait for room.
  std::uint64_t rounds = 1;          // 0: until stopped; later rounds have new sessions
  bool ends_stream = true;           // announce the ends of tests, also after the last frame
  bool json = false;
};

/// Sends the remaining frames of `run` with their recorded sessions and ids, and prints the tally. False when a frame
/// was lost or the replay was stopped. Throws Error{bad_config | endpoint_unavailable}.
[[nodiscard]] bool replay_to_socket(RecordedRun& run, const SocketReplayOptions& options);

}  // namespace lbea::tool
