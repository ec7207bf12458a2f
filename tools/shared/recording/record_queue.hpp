// The queue of records between the thread that receives messages and the thread that writes them.
#pragma once

#include "tools/shared/recording/recording_file.hpp"
#include "tools/shared/system/mirrored_memory.hpp"

#include <algorithm>
#include <deque>

namespace lbea::tool {

/// A ring buffer of MCAP records for one producer and one consumer thread. It is mapped twice in a row, so that its
/// contents are always contiguous: a chunk is written to the file without copying.
class RecordRing {
 public:
  /// At least `bytes`, rounded up to whole pages, which are touched once to avoid page faults later.
  /// Throws Error{bad_config} when the system has not enough memory.
  explicit RecordRing(std::size_t bytes) : memory_(bytes) {}

  [[nodiscard]] std::size_t capacity() const noexcept { return memory_.size(); }
  /// Bytes put and not yet released; exact only for the two threads themselves.
  [[nodiscard]] std::size_t used() const noexcept {
    const std::uint64_t released =
        released_.load(std::memory_order_acquire);  // read first, so that it is not the larger
    return std::min(static_cast<std::size_t>(written_.load(std::memory_order_acquire) - released), capacity());
  }

  // Producer.
  /// Appends `head` and `body` as one record; false when there is no room. Never blocks.
  bool put(mcap::Bytes head, mcap::Bytes body) noexcept;

  // Consumer.
  /// All records in the ring.
  [[nodiscard]] mcap::Bytes readable() const noexcept;
  /// Removes the first `bytes` of them.
  void release(std::size_t bytes) noexcept { released_.fetch_add(bytes, std::memory_order_release); }

 private:
  static constexpr std::size_t cache_line = 64;
  MirroredMemory memory_;
  alignas(cache_line) std::atomic<std::uint64_t> written_{0};
  alignas(cache_line) std::atomic<std::uint64_t> released_{0};
};

/// A ring with counts of what became of each message, and the limits of a window.
class RecordQueue {
 public:
  /// `definitions` receives all definitions that pass, also those whose messages are not written; it must outlive the
  /// queue. Throws Error{bad_config} when there is not enough memory for the ring.
  RecordQueue(std::size_t ring_bytes, RepeatedDefinitions& definitions)
      : ring_(ring_bytes), definitions_(definitions) {}

  // One thread; neither function blocks or allocates.
  /// False when the message was lost, which is counted.
  bool put(const mcap::Message& message) noexcept;
  /// False when there is no room; nothing is counted.
  bool put_channel(mcap::Bytes record) noexcept { return ring_.put(record, {}); }

  // Any thread.
  [[nodiscard]] RecorderStatus::Queue counts() const noexcept { return {recorded_, no_room_, write_failed_, outside_}; }
  [[nodiscard]] std::size_t used() const noexcept { return ring_.used(); }
  [[nodiscard]] std::size_t peak() const noexcept { return peak_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return ring_.capacity(); }

  // The writing thread.
  /// Before the trigger: discards what is older than `oldest_ns`, and more when the ring is nearly full.
  void discard_before(std::int64_t oldest_ns);
  /// After the trigger: what is older than `begin_ns` is outside the window, and what was discarded since then is lost.
  void begin_window(std::int64_t begin_ns);
  /// Whole records at the front.
  struct Batch {
    mcap::Bytes records;
    std::uint64_t messages = 0;
  };
  /// At most `most` bytes, but at least one record, and nothing from the first message after `end_ns` on.
  [[nodiscard]] Batch front(std::size_t most, std::int64_t end_ns);
  /// Counts and removes the batch that front() returned last.
  void release(const Batch& batch, bool written) noexcept;
  /// Whether the last batch ended before a message after the window.
  [[nodiscard]] bool is_past_window() const noexcept { return is_past_window_; }
  /// After the end of the file: discards everything, as lost if it was wanted and otherwise as outside the window.
  void discard_all(bool wanted);

 private:
  template <class Unwanted>
  void discard_while(const Unwanted& is_unwanted, std::atomic<std::uint64_t>& count);

  RecordRing ring_;
  RepeatedDefinitions& definitions_;
  std::atomic<std::uint64_t> recorded_{0}, no_room_{0}, write_failed_{0}, outside_{0};
  std::atomic<std::size_t> peak_{0};
  std::deque<std::int64_t> discarded_;  // log times of what was discarded for want of room before the trigger
  bool is_past_window_ = false;
};

}  // namespace lbea::tool
