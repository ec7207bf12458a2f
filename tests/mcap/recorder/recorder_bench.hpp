// Sinks, messages and checks of the recorder's tests.
#pragma once

#include "tests/mcap/format/mcap_support.hpp"
#include "tools/shared/recording/recorder.hpp"
#include "tools/shared/recording/recording_format.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <limits>
#include <mutex>

namespace lbea::test {

/// A memory sink that outlives its recorder, may stall, and may be read while it is written.
class SharedSink final : public mcap::Sink {
 public:
  struct State {
    std::mutex mutex;
    MemorySink memory;
    std::atomic<std::chrono::milliseconds> stall{std::chrono::milliseconds(0)};
    std::uint64_t capacity = std::numeric_limits<std::uint64_t>::max();
    mcap::Buffer snapshot() {
      const std::lock_guard lock(mutex);
      return memory.bytes;
    }
  };
  explicit SharedSink(std::shared_ptr<State> state) : state_(std::move(state)) {}
  int append(std::span<const mcap::Bytes> pieces) noexcept override {
    std::this_thread::sleep_for(state_->stall.load());
    const std::lock_guard lock(state_->mutex);
    std::uint64_t bytes = 0;
    for (const mcap::Bytes piece : pieces) bytes += piece.size();
    return bytes > state_->capacity - state_->memory.bytes.size() ? ENOSPC : state_->memory.append(pieces);
  }
  [[nodiscard]] std::uint64_t free_bytes() const noexcept override {
    const std::lock_guard lock(state_->mutex);
    return state_->capacity - state_->memory.bytes.size();
  }
  int sync() noexcept override { return 0; }  // called by another thread, so not numbered
  int commit() noexcept override {
    const std::lock_guard lock(state_->mutex);
    return state_->memory.commit();
  }

 private:
  std::shared_ptr<State> state_;
};

constexpr std::uint16_t status_channel = 9;

inline tool::RecordingStart a_start() {
  tool::RecordingStart start;
  start.header = {"test", "test"};
  start.schemas = {a_schema(1), a_schema(2)};
  start.channels = {a_channel(1, 1), a_channel(2, 2), a_channel(status_channel, 0)};
  start.metadata = {{"about", {{"a", "b"}}}};
  start.status_channel = status_channel;
  return start;
}

inline tool::RecorderConfig small_config() {
  tool::RecorderConfig config;
  config.frame_ring_bytes = 1 << 20;
  config.note_ring_bytes = 1 << 20;
  config.chunk_bytes = 1 << 14;
  return config;
}

inline std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// A message with unique data.
inline Said numbered(std::uint16_t channel, std::uint32_t number, std::size_t bytes, std::int64_t time = 0) {
  std::string data = std::to_string(channel) + ":" + std::to_string(number) + ":";
  data.resize(std::max(bytes, data.size()), static_cast<char>('a' + number % 26));
  return {channel, number, static_cast<std::uint64_t>(time != 0 ? time : now_ns()), number, data};
}

inline std::vector<Said> on_channel(const std::vector<Said>& messages, std::uint16_t channel) {
  std::vector<Said> found;
  for (const Said& message : messages)
    if (message.channel == channel) found.push_back(message);
  return found;
}

inline std::uint64_t number_in(const mcap::FileCheck& audit, const std::string& key) {
  for (const mcap::Metadata& metadata : audit.metadata)
    if (metadata.name == tool::closing_metadata_name) return std::stoull(metadata.texts.at(key));
  return ~std::uint64_t{0};
}

inline void check_sound(const mcap::FileCheck& audit) {
  for (const std::string& error : audit.errors) CHECK_MESSAGE(false, error);
  CHECK(audit.is_intact());
  CHECK(audit.has_summary);
}

}  // namespace lbea::test
