// Frames in and out, results out and in. One thread per object at a time; constructors throw
// Error{bad_config | endpoint_unavailable}, the rest never throws.
//
// Frames go PUSH to PULL, which never discards: connect one sender per matcher and never a second PULL, which
// would take every other frame. Results go PUB to SUB, which discards silently when a subscriber is slow: the
// messages' sequence numbers show it.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/codec/messages.hpp"

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace lbea::wire {

/// One per process, outliving all streams.
class WireContext {
 public:
  WireContext();
  ~WireContext();
  struct State;
  [[nodiscard]] State& state() noexcept { return *state_; }

 private:
  std::unique_ptr<State> state_;
};

using Message = std::span<const std::byte>;

/// Who is at a bound socket and who was turned away.
struct PeerCounts {
  std::uint64_t connections = 0;  // now, strangers included
  std::uint64_t peers = 0;        // now, admitted
  std::uint64_t admitted = 0;
  std::uint64_t unknown = 0;    // turned away: no key, or one that is not allowed
  std::uint64_t excess = 0;     // turned away: as many peers as may be are there
  std::uint64_t malformed = 0;  // ended before they were known: silent too long, or not ZeroMQ's protocol
};

/// Somebody who came to a bound socket and said who they are.
struct PeerVisit {
  enum class Answer : std::uint8_t { admitted, unknown, excess };  // as in PeerCounts
  Answer answer = Answer::unknown;
  std::string name;     // of the key's owner; empty for keys that are not allowed, and without keys
  std::string address;  // as ZeroMQ has it: an IP address, over ipc localhost:USER:GROUP:PROCESS in numbers
};

/// Where the matcher takes frames from: binds.
class FrameSource {
 public:
  FrameSource(WireContext& context, const std::string& endpoint, WireLimits limits = {},
              const ServerAccess& access = {});
  ~FrameSource();
  FrameSource(FrameSource&&) noexcept;
  FrameSource& operator=(FrameSource&&) noexcept;
  /// The endpoint as bound: with the port's number where "*" was asked for.
  [[nodiscard]] const std::string& endpoint() const noexcept;
  /// The next message, valid until the next call; nothing when none comes within `timeout` or a signal does.
  [[nodiscard]] std::optional<Message> receive(std::chrono::milliseconds timeout) noexcept;
  [[nodiscard]] PeerCounts peers() const noexcept;  // any thread
  /// Those since the last call, at most 64: the first of a crowd. Any thread.
  [[nodiscard]] std::vector<PeerVisit> visits();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Where a camera puts frames: connects.
class FrameSink {
 public:
  struct Tally {
    std::uint64_t sent = 0;     // taken over by the socket
    std::uint64_t refused = 0;  // the receiver was absent or its queue full
  };

  FrameSink(WireContext& context, const std::string& endpoint, std::uint32_t queued_messages = default_queued_messages,
            const ClientAccess& access = {});
  ~FrameSink();
  FrameSink(FrameSink&&) noexcept;
  FrameSink& operator=(FrameSink&&) noexcept;
  /// Whether a receiver is connected and has room, waiting up to `timeout` for it.
  [[nodiscard]] bool wait_ready(std::chrono::milliseconds timeout) noexcept;
  /// Sends a copy, or counts a refusal when there is no room within `timeout` (0: at once).
  bool send(Message message, std::chrono::milliseconds timeout = {}) noexcept;
  /// Sends a copy of something that is no frame: the tally does not count it.
  bool tell(Message message, std::chrono::milliseconds timeout = {}) noexcept;
  /// Sends without copying: `message` is kept alive until the receiver's machine has it (use_count drops).
  bool send(const std::shared_ptr<const std::vector<std::byte>>& message,
            std::chrono::milliseconds timeout = {}) noexcept;
  [[nodiscard]] const Tally& tally() const noexcept;
  /// Frames taken over by the socket and still in this process; waits up to `timeout` for no message at all, and over
  /// ipc until the receiver has read the connection empty: ZeroMQ throws away what is unread in one whose sender leaves
  /// while the receiver's queue is full. Over tcp only results tell what has been read. To be called before a sink is
  /// destroyed.
  [[nodiscard]] std::uint64_t flush(std::chrono::milliseconds timeout) noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Messages that wait for a subscriber who reads slowly: seconds of results, 6 MB for one that stalls.
inline constexpr int results_held = 10'000;

/// Where the matcher puts results: binds. Never waits for subscribers; what exceeds `held` is discarded.
class ResultSink {
 public:
  ResultSink(WireContext& context, const std::string& endpoint, int held = results_held,
             const ServerAccess& access = {});
  ~ResultSink();
  ResultSink(ResultSink&&) noexcept;
  ResultSink& operator=(ResultSink&&) noexcept;
  [[nodiscard]] const std::string& endpoint() const noexcept;
  bool send(Message message) noexcept;
  /// Whether anyone subscribed since the last call: who comes late wants the state.
  [[nodiscard]] bool has_newcomer() noexcept;
  [[nodiscard]] PeerCounts peers() const noexcept;  // any thread
  [[nodiscard]] std::vector<PeerVisit> visits();    // any thread

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Where anyone reads results and states: connects.
class ResultSource {
 public:
  ResultSource(WireContext& context, const std::string& endpoint, int held = results_held,
               const ClientAccess& access = {});
  ~ResultSource();
  ResultSource(ResultSource&&) noexcept;
  ResultSource& operator=(ResultSource&&) noexcept;
  [[nodiscard]] std::optional<Message> receive(std::chrono::milliseconds timeout) noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea::wire
