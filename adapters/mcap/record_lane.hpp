// One of a recorder's two lanes: the ring between who puts messages in and the thread that writes them, what became of
// each message, and where a window cuts.
#pragma once

#include "adapters/mcap/record_ring.hpp"
#include "adapters/mcap/recorder_status.hpp"
#include "adapters/mcap/repeated_definitions.hpp"

#include <deque>

namespace lbea::mcap {

class RecordLane {
 public:
  /// `definitions` takes what comes by of them, whether the messages around it are written or not, and outlives the
  /// lane. Throws Error{bad_config} when there is no memory for the ring.
  RecordLane(std::size_t ring_bytes, RepeatedDefinitions& definitions) : ring_(ring_bytes), definitions_(definitions) {}

  // one thread's; neither blocks nor allocates
  /// False when it was lost, which is counted.
  bool put(const mcap::Message& message) noexcept;
  /// False when there is no room; nothing is counted.
  bool put_channel(mcap::Bytes record) noexcept { return ring_.put(record, {}); }

  // any thread's
  [[nodiscard]] RecorderStatus::Lane counts() const noexcept { return {recorded_, no_room_, write_failed_, outside_}; }
  [[nodiscard]] std::size_t used() const noexcept { return ring_.used(); }
  [[nodiscard]] std::size_t peak() const noexcept { return peak_; }
  [[nodiscard]] std::size_t capacity() const noexcept { return ring_.capacity(); }

  // the writing thread's
  /// While nothing has happened yet: keeps what is not older than `oldest_ns`, and room for what comes.
  void forget_before(std::int64_t oldest_ns);
  /// Something happened: what is older than `begin_ns` was not asked for, and what is missing since then is lost.
  void begin_at(std::int64_t begin_ns);
  /// Whole records at the front.
  struct Cut {
    mcap::Bytes records;
    std::uint64_t messages = 0;
  };
  /// At most `most` bytes, but a record at least, and nothing from the first message after `end_ns` on.
  [[nodiscard]] Cut cut(std::size_t most, std::int64_t end_ns);
  /// Counts and gives back what was cut last.
  void release(const Cut& cut, bool written) noexcept;
  /// What was cut last ended before a message after the window.
  [[nodiscard]] bool is_past_window() const noexcept { return is_past_window_; }
  /// The file has ended: what still comes is lost if it was wanted, and else outside.
  void drop_all(bool wanted);

 private:
  template <class Unwanted>
  void drop_while(const Unwanted& is_unwanted, std::atomic<std::uint64_t>& count);

  mcap::RecordRing ring_;
  RepeatedDefinitions& definitions_;
  std::atomic<std::uint64_t> recorded_{0}, no_room_{0}, write_failed_{0}, outside_{0};
  std::atomic<std::size_t> peak_{0};
  std::deque<std::int64_t> pushed_out_;  // log times of what a full ring lost while armed
  bool is_past_window_ = false;
};

}  // namespace lbea::mcap
