// Sends a playlist at its pace.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/send/playlist.hpp"

#include <functional>

namespace lbea::tool {

struct PlayConfig {
  std::uint64_t session = 0;
  std::uint64_t rounds = 1;             // 0: until stopped
  std::vector<std::int64_t> due_ns;     // from playlist.hpp; empty: as fast as the receiver takes them
  bool ends_stream = true;              // say after the last frame that the test is over
  std::uint64_t max_message_bytes = 0;  // larger ones would cost the connection; 0: not known
};

struct PlayTally {
  std::uint64_t captured = 0;  // frames whose time came: sent + refused
  std::uint64_t sent = 0;      // taken over by the socket
  std::uint64_t refused = 0;   // no room at the receiver, as for a camera that cannot wait, or too large
  std::uint64_t handed_over =
      0;  // of those sent, how many left this process; one more may have, which ZeroMQ lets go of with the next
  double seconds = 0;
};

/// Sends until all rounds are done or `stop` says so; `progress` is called with the number of frames so far.
/// A frame whose time has come does not wait: without room at the receiver it is refused and its id is
/// skipped, and the receiver told of it as soon as there is room. Without a pace nothing is refused for want of
/// room; sending waits. When nothing is due for a while the receiver is told that the sender lives.
[[nodiscard]] PlayTally play(const std::vector<EncodedCloud>& clouds, const PlayConfig& config, wire::FrameSink& sink,
                             const std::function<bool()>& stop, const std::function<void(std::uint64_t)>& progress);

}  // namespace lbea::tool
