// The clouds to send, encoded before the first one is sent, so that the pace depends only on the clock; and the sender.
#pragma once

#include "adapters/wire/sockets/client.hpp"

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace lbea::tool {

struct EncodedCloud {
  std::filesystem::path file;
  std::shared_ptr<std::vector<std::byte>> message;
  std::optional<std::int64_t> stamp_ns;  // none without one in table, file or file name
};

/// Reads and encodes. Stamps come from the table `stamps` or, when it is empty, from stamps.csv beside the clouds;
/// otherwise from the clouds, otherwise from their file names. `columns` as in read_point_cloud(). `progress` is called
/// with the number done. Throws what read_point_cloud throws, and Error{bad_input} for a stamp outside the wire
/// format's range.
[[nodiscard]] std::vector<EncodedCloud> encode_clouds(const std::vector<std::filesystem::path>& files,
                                                      const std::filesystem::path& stamps, const std::string& columns,
                                                      std::uint64_t session, const std::string& frame_id,
                                                      const std::function<void(std::size_t)>& progress);

/// Due times by the clouds' stamps, in ns after the first cloud: one per cloud, then one for the second round's first.
/// Throws Error{bad_input} when a cloud has no stamp or an earlier one than its predecessor.
[[nodiscard]] std::vector<std::int64_t> schedule_by_stamps(const std::vector<EncodedCloud>& clouds);
/// The same at a constant rate `rate_hz` > 0.
[[nodiscard]] std::vector<std::int64_t> schedule_by_rate(std::size_t clouds, double rate_hz);

struct PlayConfig {
  std::uint64_t session = 0;
  std::uint64_t rounds = 1;  // 0: until stopped
  std::vector<std::int64_t>
      due_ns;  // by schedule_by_stamps() or schedule_by_rate(); empty: as fast as the receiver accepts them
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
