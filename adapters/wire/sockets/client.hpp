// The two ends of a running lbea-serve: FrameSender for the camera's program, ResultReceiver for programs that use the
// results. Constructors throw Error{bad_config | endpoint_unavailable}.
#pragma once

#include "adapters/wire/sockets/streams.hpp"

namespace lbea::wire {
/// A random number for a new session of a sender.
[[nodiscard]] std::uint64_t new_session();

inline constexpr std::chrono::milliseconds default_patience{5000};

/// Waits until the receiver admits `sink` and has room, at most for `patience`; false also once it refuses.
[[nodiscard]] bool wait_admitted(FrameSink& sink, std::chrono::milliseconds patience) noexcept;

struct SendTally {
  std::uint64_t captured = 0;  // sent + refused
  std::uint64_t sent = 0;      // accepted by the socket
  std::uint64_t refused = 0;   // no room at the receiver, or not sendable
  // Of those sent, how many left this process. One more may have: ZeroMQ releases a message with the next one.
  std::uint64_t handed_over = 0;
};

/// Sends captures, numbers them, and reports to the matcher: hello at the start, heartbeats in pauses, captures without
/// room, and goodbye at the end. The matcher then accounts for every capture. One thread.
class FrameSender {
 public:
  /// Waits for a receiver, at most for `patience`.
  FrameSender(WireContext& context, const std::string& endpoint, const ClientAccess& access = {},
              std::chrono::milliseconds patience = default_patience);
  /// Nobody else may use `sink` until finish().
  FrameSender(FrameSink& sink, std::uint64_t session);
  /// Calls finish().
  ~FrameSender();
  FrameSender(FrameSender&&) noexcept;
  FrameSender& operator=(FrameSender&&) = delete;

  /// Sends a capture. False when the receiver has no room within `timeout`, the stamp is before 1970 or after 2106, or
  /// the points exceed a message (2 GB); the matcher is told as soon as there is room. Without memory for a copy of the
  /// points, throws std::bad_alloc before anything is counted.
  bool send(std::span<const Point> points, std::int64_t stamp_ns, std::chrono::milliseconds timeout = {});
  /// The same for an encoded frame of this session with the id next_id(), without copying it: see FrameSink::send.
  /// Null: a capture that is not sent.
  bool send(const std::shared_ptr<const std::vector<std::byte>>& frame, std::chrono::milliseconds timeout = {});
  [[nodiscard]] bool wait_ready(std::chrono::milliseconds timeout);
  /// Marks the end of a test. Another one may follow. False when the receiver has no room for 2 s.
  bool end_stream();
  /// Sends goodbye, unless the stream has ended, and waits up to 2 s until the receiver has everything. Then this
  /// object sends nothing more.
  SendTally finish();

  [[nodiscard]] std::uint64_t session() const noexcept;
  [[nodiscard]] std::uint64_t next_id() const noexcept;
  [[nodiscard]] Link link();
  [[nodiscard]] SendTally tally() const;  // so far: handed_over is 0

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Receives results and states, decoded. One thread.
class ResultReceiver {
 public:
  ResultReceiver(WireContext& context, const std::string& endpoint, const ClientAccess& access = {},
                 int held = results_held)
      : source_(context, endpoint, held, access) {}

  /// The next result, valid until the next call. Null when none arrives within `timeout`, or on a signal.
  [[nodiscard]] const WireResult* receive(std::chrono::milliseconds timeout);
  /// The latest state of the matcher: model, method, senders. Null before the first one, which arrives within half a
  /// second.
  [[nodiscard]] const WireState* state() const noexcept { return state_ ? &*state_ : nullptr; }
  /// Messages that were discarded because this receiver was too slow. Those that a restarted matcher sent before this
  /// receiver reconnected are not counted.
  [[nodiscard]] std::uint64_t lost() const noexcept { return lost_ + lost_since_state_; }
  /// Whether the latest message was a state, not a result.
  [[nodiscard]] bool ends_with_state() const noexcept { return ends_with_state_; }
  /// Messages that could not be read.
  [[nodiscard]] std::uint64_t damaged() const noexcept { return damaged_; }
  [[nodiscard]] Link link() noexcept { return source_.link(); }

 private:
  [[nodiscard]] bool read(Message message);
  void count(std::uint64_t sequence);

  ResultSource source_;
  WireResult result_;
  std::optional<WireState> state_;
  std::optional<std::uint64_t> next_sequence_;
  std::uint64_t lost_ = 0, lost_since_state_ = 0, damaged_ = 0;
  bool ends_with_state_ = false;
};
}  // namespace lbea::wire
