// Reads the messages of a recorded run in the order in which they were recorded.
#pragma once

#include "adapters/mcap/reader.hpp"
#include "tools/shared/recording/recording_format.hpp"

namespace lbea::tool {

/// A test of a run: its session, and how often the stream of the session ended before it.
using TestKey = std::pair<std::uint64_t, std::uint64_t>;

/// `data` is valid until the next message is read.
struct RecordedMessage {
  enum class Kind : std::uint8_t { frame, result, state, other };
  Kind kind = Kind::other;
  std::int64_t log_time_ns = 0;  // frames: received; results and states: published
  mcap::Bytes data;              // a foxglove.PointCloud, a Result, a State
  // Frames only.
  std::uint64_t session = 0, id = 0;
  std::int64_t stamp_ns = 0;
  std::string_view rig{};  // of several; valid as `data` is
};

/// The contents of a channel, from its topic and metadata.
struct RecordedChannel {
  RecordedMessage::Kind kind = RecordedMessage::Kind::other;
  std::uint64_t session = 0, id_high = 0;
  std::string rig{};
};
/// Nothing for a frame channel with invalid metadata.
[[nodiscard]] std::optional<RecordedChannel> channel_of(const mcap::Channel& channel);
[[nodiscard]] RecordedMessage recorded_message(const mcap::Message& message, const RecordedChannel& channel);

class RecordedRun {
 public:
  /// Throws Error{file_not_found | bad_input}, also for a file that was cut off: recover it first.
  explicit RecordedRun(const std::filesystem::path& file);

  [[nodiscard]] const RunSettings& settings() const noexcept { return settings_; }
  /// Returns only messages with log times in [from, to] from now on.
  void limit(std::int64_t from_ns, std::int64_t to_ns);
  /// The next message; nothing after the last. Throws Error{bad_input} when the file is damaged.
  [[nodiscard]] std::optional<RecordedMessage> next();
  void rewind();

 private:
  void read_front();
  bool next_chunk();
  [[noreturn]] void fail(std::uint64_t byte, const std::string& what) const;
  std::optional<RecordedMessage> decode(const mcap::Record& record);
  void add_channel(const mcap::Record& record);

  mcap::FileSource source_;
  RunSettings settings_;
  mcap::FileReader reader_;
  mcap::OpenChunk chunk_;
  mcap::Bytes rest_;  // of the current chunk
  std::uint64_t chunk_offset_ = 0, offset_ = 0;
  std::map<std::uint16_t, RecordedChannel> channels_;
  std::int64_t from_ns_, to_ns_;
};

}  // namespace lbea::tool
