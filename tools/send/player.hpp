// Sends a playlist at a given pace.
#pragma once

#include "adapters/wire/sockets/client.hpp"
#include "tools/send/playlist.hpp"

#include <functional>

namespace lbea::tool {

struct PlayConfig {
  std::uint64_t session = 0;
  std::uint64_t rounds = 1;             // 0: until stopped
  std::vector<std::int64_t> due_ns;     // from playlist.hpp; empty: as fast as the receiver accepts them
  bool ends_stream = true;              // send an end of stream after the last frame
  std::uint64_t max_message_bytes = 0;  // larger ones would break the connection; 0: unknown
};

struct PlayTally : wire::SendTally {
  double seconds = 0;
};

/// Sends until all rounds are done or `stop` returns true; `progress` is called with the number of frames so far. With
/// a pace, a due frame does not wait: without room at the receiver it is refused, its id is skipped, and the receiver
/// is informed as soon as there is room. Without a pace, sending waits for room. In pauses the receiver gets
/// heartbeats.
[[nodiscard]] PlayTally play(const std::vector<EncodedCloud>& clouds, const PlayConfig& config, wire::FrameSink& sink,
                             const std::function<bool()>& stop, const std::function<void(std::uint64_t)>& progress);

}  // namespace lbea::tool
