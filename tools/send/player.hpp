// Sends the clouds of files. All are encoded before the first one is sent, so that the pace depends only on the clock.
#pragma once

#include "tools/shared/intake/access_options.hpp"

#include <filesystem>
#include <optional>

namespace lbea::tool {

struct SendOptions {
  std::vector<std::string> paths;
  std::filesystem::path stamps;
  std::string endpoint, results_endpoint, columns, frame_id = "sensor";
  double rate_hz = 0;                      // 0: as fast as the receiver accepts them
  bool realtime = false;                   // pace by the clouds' stamps
  std::optional<std::int64_t> begin_ns{};  // with `realtime`: when to begin, and the first stamp, ns since 1970
  std::uint64_t rounds = 1;                // 0: until stopped
  bool ends_stream = true;  // send an end of stream after the last frame, and after each round of stamped clouds
  bool wait_ready = false, json = false;
  ClientAccessOptions access;
};

/// Sends until all rounds are done or a stop signal, and prints the tally. With a pace, a due frame does not wait:
/// without room at the receiver it is refused, its id is skipped, and the receiver is informed as soon as there is
/// room. Without a pace, sending waits for room. In pauses the receiver gets heartbeats. Returns the exit code. Throws
/// what read_point_cloud() throws, and Error{bad_input | endpoint_unavailable}.
int send(const SendOptions& options);

}  // namespace lbea::tool
