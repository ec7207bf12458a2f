// Forwards frames and control messages to the matcher. Only finish() waits.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <chrono>
#include <deque>
#include <map>

namespace lbea::tool {

/// A control message, or an end of stream.
struct SenderControl {
  wire::Control control;
  bool ends_stream = false;  // sent as a frame message, because an end of stream gets a result too
};

/// Control messages that wait for room at the matcher. Of each session it keeps few, which lead a receiver to the same
/// account as all of them: the first, because ids count from it on; those that withhold ids; ends of stream; the
/// latest.
class PendingControls {
 public:
  static constexpr std::size_t max_size = 4096;  // beyond it the oldest are discarded

  void add(const SenderControl& control);
  [[nodiscard]] bool empty() const noexcept { return queue_.empty(); }
  [[nodiscard]] std::size_t size() const noexcept { return queue_.size(); }
  /// The next one to send; not when empty.
  [[nodiscard]] const SenderControl& front() const noexcept { return queue_.front(); }
  void pop() { queue_.pop_front(); }

 private:
  SenderControl* replaceable_by(const wire::Control& later);
  std::deque<SenderControl> queue_;
};

/// For one thread.
class Forwarder {
 public:
  explicit Forwarder(wire::FrameSink sink) : sink_(std::move(sink)) {}
  /// Forwards a control message now, or as soon as there is room.
  void send_control(const SenderControl& control);
  /// Forwards a frame; false when there is no room for it or for a control message before it.
  bool send(wire::Message frame);
  /// Forwards pending control messages while there is room; whether none is left.
  bool send_pending();
  struct LeftOver {
    std::uint64_t controls = 0, frames = 0;
  };
  /// Waits up to `timeout` until everything has left this process.
  [[nodiscard]] LeftOver finish(std::chrono::milliseconds timeout);

 private:
  wire::FrameSink sink_;
  wire::Encoder encoder_;
  PendingControls pending_;
};

/// How many frames of each session a matcher has received, by its states. A matcher that was started again counts anew.
class DeliveredFrames {
 public:
  void add(const wire::WireState& state);
  [[nodiscard]] bool empty() const noexcept { return start_ns_ == 0; }
  /// A matcher has ended: what it received after its last state is not known.
  [[nodiscard]] bool has_former() const noexcept { return !by_former_.empty(); }
  /// Of the frames that these senders sent, those that no matcher received.
  [[nodiscard]] std::uint64_t missing_of(const std::vector<wire::WireSender>& senders) const;

 private:
  std::int64_t start_ns_ = 0;                       // of the matcher
  static constexpr std::size_t most_former = 1024;  // against forged states
  std::map<std::uint64_t, std::uint64_t> by_former_;
  std::vector<wire::WireSender> latest_;
};

}  // namespace lbea::tool
