// The receiving thread of a program that takes frames: receives and checks messages, keeps the account of the senders'
// ids, and passes everything on to a sink.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <atomic>
#include <mutex>

namespace lbea::tool {

/// The counters of a run, written by its threads and read by all of them.
class SharedCounters {
 public:
  void count_received() noexcept { add(received_); }
  void count(wire::WireStatus status) noexcept { add(by_status_[static_cast<std::size_t>(status)]); }
  void count_unannounced(std::uint64_t frames = 1) noexcept { add(unannounced_, frames); }
  void store(const IdTracker& ids) noexcept;
  void store_silent(std::uint64_t senders) noexcept { set(silent_, senders); }
  /// `received` may be ahead of the sum of the statuses by the frames in the queues; never the reverse.
  [[nodiscard]] wire::Counters load() const noexcept;
  [[nodiscard]] std::uint64_t sessions() const noexcept { return sessions_.load(std::memory_order_relaxed); }

 private:
  using Count = std::atomic<std::uint64_t>;
  static void add(Count& count, std::uint64_t n = 1) noexcept { count.fetch_add(n, std::memory_order_release); }
  static void set(Count& count, std::uint64_t value) noexcept { count.store(value, std::memory_order_release); }
  Count received_{0}, duplicates_{0}, reordered_{0}, sessions_{0}, silent_{0}, interleaved_{0}, unannounced_{0};
  std::array<Count, wire::wire_status_count> by_status_{};
};

/// The receiver's list of senders, for threads that publish it.
class SharedSenders {
 public:
  void store(std::vector<wire::WireSender> senders) {
    const std::lock_guard lock(mutex_);
    senders_.swap(senders);
  }
  [[nodiscard]] std::vector<wire::WireSender> load() const {
    const std::lock_guard lock(mutex_);
    return senders_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<wire::WireSender> senders_;
};

struct SharedAccount {
  SharedCounters counters;
  SharedSenders senders;
};

/// A message after its checks; valid during the sink's call.
struct ReceivedFrame {
  wire::Message message;
  const wire::FrameDecoder& decoder;  // has opened `message`
  wire::WireStatus message_status;    // of the message alone
  wire::WireStatus status;            // of the message and its id: ok, end_of_stream, or the reason for rejection
  std::int64_t receive_ns = 0;
  IdTracker::Clock::time_point begin;  // of decoding
  bool is_draining = false;            // stop() was called; what is left may wait for room
};

/// Where a FrameReceiver passes messages to. All calls come from the receiving thread.
class IntakeSink {
 public:
  virtual ~IntakeSink() = default;
  /// A frame, an end of stream, or a message to reject.
  virtual void on_frame(const ReceivedFrame& frame) noexcept = 0;
  /// Captures of which no frame arrived; status: missed or withheld.
  virtual void on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids,
                         std::int64_t receive_ns) noexcept = 0;
  /// A control message, after it was counted.
  virtual void on_control(const wire::Control& control) noexcept = 0;
  /// No message arrived within the receive timeout.
  virtual void on_idle() noexcept {}
};

class FrameReceiver {
 public:
  /// A sender is silent after `sender_timeout` without a message. `account` and `sink` must outlive the receiver.
  FrameReceiver(wire::FrameSource source, wire::WireLimits limits, std::chrono::milliseconds sender_timeout,
                SharedAccount& account, IntakeSink& sink);
  /// Before run(): frames of a second sender get the status other_sender while the first one's test is running.
  void allow_one_sender() { ids_.allow_one_sender(sender_timeout_); }
  /// Runs until stop(), then takes in what has already arrived.
  void run() noexcept;
  /// The same for several receivers on one thread, until one of them is stopped.
  static void run_together(std::span<FrameReceiver* const> receivers) noexcept;
  // Any thread:
  void stop() noexcept { stopping_ = true; }
  [[nodiscard]] wire::PeerCounts peers() const noexcept { return source_.peers(); }
  [[nodiscard]] std::vector<wire::PeerVisit> visits() { return source_.visits(); }
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  using Clock = IdTracker::Clock;
  bool receive_next(std::chrono::milliseconds timeout, bool is_draining) noexcept;
  static bool receive_from_any(std::span<FrameReceiver* const> receivers,
                               std::span<const wire::FrameSource* const> sources, std::chrono::milliseconds timeout,
                               bool is_draining) noexcept;
  void receive(wire::Message message, bool is_draining) noexcept;
  bool receive_control(wire::Message message, std::int64_t receive_ns) noexcept;
  [[nodiscard]] wire::WireStatus account_for(wire::WireStatus status, std::int64_t receive_ns) noexcept;
  bool report(const wire::Control& control, std::int64_t receive_ns) noexcept;
  void pass_absent(wire::WireStatus status, std::uint64_t session, IdRange ids, std::int64_t receive_ns) noexcept;
  void publish_senders(Clock::time_point now, Clock::duration timeout) noexcept;

  wire::FrameSource source_;
  wire::FrameDecoder decoder_;
  std::chrono::milliseconds sender_timeout_;
  IdTracker ids_;
  Clock::time_point next_publication_{};
  SharedAccount& account_;
  IntakeSink& sink_;
  std::atomic<bool> stopping_{false};
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
