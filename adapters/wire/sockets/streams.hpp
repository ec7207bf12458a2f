// Sockets that send and receive frames and results. One thread per object at a time. Constructors throw
// Error{bad_config | endpoint_unavailable}; the other functions do not throw.
//
// Frames use PUSH and PULL, which never discard. Connect one sender to one matcher; a second PULL would receive every
// other frame. Results use PUB and SUB, which discard silently when a subscriber is slow; the messages' sequence
// numbers show it.
#pragma once

#include "adapters/wire/access/keys.hpp"
#include "adapters/wire/codec/messages.hpp"

#include <chrono>
#include <optional>

namespace lbea::wire {
/// One per process; must outlive all streams.
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

/// Connections of a bound socket.
struct PeerCounts {
  std::uint64_t connections = 0;  // now, including those not yet admitted
  std::uint64_t peers = 0;        // now, admitted
  std::uint64_t admitted = 0;
  std::uint64_t unknown = 0;    // refused: no key, or one that is not allowed
  std::uint64_t excess = 0;     // refused: the maximum number of peers is connected
  std::uint64_t malformed = 0;  // ended before authentication: handshake timeout, or not ZeroMQ's protocol
  std::uint64_t crowded = 0;    // refused: the process has few descriptors left
  std::uint64_t offending = 0;  // disconnected after admission: broke the protocol or a limit

  /// Of several sockets together.
  PeerCounts& operator+=(const PeerCounts& more) noexcept;
};

/// A peer that connected to a bound socket and identified itself, or that was disconnected.
struct PeerVisit {
  enum class Answer : std::uint8_t { admitted, unknown, excess, offending };  // as in PeerCounts
  Answer answer = Answer::unknown;
  std::string name;          // of the key's owner; empty without keys and for keys that are not allowed
  std::string address;       // from ZeroMQ: an IP address, over ipc localhost:USER:GROUP:PROCESS in numbers
  const char* offense = "";  // offending: what the peer sent
};

/// Whether bound sockets survive every peer: libzmq has the patches of third_party/zmq.
[[nodiscard]] bool has_peer_bounds() noexcept;

/// Receives frames, in the matcher: binds.
class FrameSource {
 public:
  FrameSource(WireContext& context, const std::string& endpoint, WireLimits limits = {},
              const ServerAccess& access = {});
  ~FrameSource();
  FrameSource(FrameSource&&) noexcept;
  FrameSource& operator=(FrameSource&&) noexcept;
  /// The endpoint as bound, with the port number in place of "*".
  [[nodiscard]] const std::string& endpoint() const noexcept;
  /// The next message, valid until the next call; nothing when none arrives within `timeout` or on a signal.
  [[nodiscard]] std::optional<Message> receive(std::chrono::milliseconds timeout) noexcept;
  [[nodiscard]] PeerCounts peers() const noexcept;  // any thread
  /// Visits since the last call, at most the first 64. Any thread.
  [[nodiscard]] std::vector<PeerVisit> visits();

 private:
  struct State;
  std::unique_ptr<State> state_;
  friend void wait_for_any(std::span<const FrameSource* const> sources, std::chrono::milliseconds timeout) noexcept;
};

/// Waits until one of the sources has a message, at most for `timeout`.
void wait_for_any(std::span<const FrameSource* const> sources, std::chrono::milliseconds timeout) noexcept;

/// How the other end answered the latest connection of a connecting socket. Not known over inproc: absent.
enum class Link : std::uint8_t {
  absent,  // nobody listens there, or not any more
  admitted,
  refused,   // by access control: this program's key is not allowed; ZeroMQ does not try again
  unusable,  // no handshake: keys on one side only, another server key, too many peers, or not ZeroMQ
};
/// A sentence that names the endpoint and the remedy. `option`: of lbea-serve, --frames or --results.
[[nodiscard]] std::string explain(Link link, const std::string& endpoint, const char* option);

/// Sends frames, in a camera's program: connects.
class FrameSink {
 public:
  struct Tally {
    std::uint64_t sent = 0;     // accepted by the socket
    std::uint64_t refused = 0;  // the receiver was absent or its queue full
  };

  FrameSink(WireContext& context, const std::string& endpoint, std::uint32_t queued_messages = default_queued_messages,
            const ClientAccess& access = {});
  ~FrameSink();
  FrameSink(FrameSink&&) noexcept;
  FrameSink& operator=(FrameSink&&) noexcept;
  /// Whether a receiver is connected and has room, waiting up to `timeout` for it.
  [[nodiscard]] bool wait_ready(std::chrono::milliseconds timeout) noexcept;
  [[nodiscard]] Link link() noexcept;
  /// Sends a copy, or counts a refusal when there is no room within `timeout` (0: at once).
  bool send(Message message, std::chrono::milliseconds timeout = {}) noexcept;
  /// Sends a copy of a message that is not a frame: the tally does not count it.
  bool tell(Message message, std::chrono::milliseconds timeout = {}) noexcept;
  /// Sends without copying: `message` is kept alive until the receiver's machine has it (use_count drops).
  bool send(const std::shared_ptr<const std::vector<std::byte>>& message,
            std::chrono::milliseconds timeout = {}) noexcept;
  [[nodiscard]] const Tally& tally() const noexcept;
  /// Waits up to `timeout` until no message is left in this process and, over ipc, until the receiver has read all:
  /// ZeroMQ discards unread messages when the sender closes while the receiver's queue is full. Over tcp only results
  /// show what was read. Returns the number of frames still in this process. Call it before destroying a sink.
  [[nodiscard]] std::uint64_t flush(std::chrono::milliseconds timeout) noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Messages held for a slow subscriber: seconds of results; 6 MB for one that stalls.
inline constexpr int results_held = 10'000;

/// Publishes results, in the matcher: binds. Never waits for subscribers; messages beyond `held` are discarded.
class ResultSink {
 public:
  ResultSink(WireContext& context, const std::string& endpoint, int held = results_held,
             const ServerAccess& access = {});
  ~ResultSink();
  ResultSink(ResultSink&&) noexcept;
  ResultSink& operator=(ResultSink&&) noexcept;
  [[nodiscard]] const std::string& endpoint() const noexcept;
  bool send(Message message) noexcept;
  /// Whether anyone has subscribed since the last call; new subscribers need the state.
  [[nodiscard]] bool has_newcomer() noexcept;
  [[nodiscard]] PeerCounts peers() const noexcept;  // any thread
  [[nodiscard]] std::vector<PeerVisit> visits();    // any thread

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Receives results and states: connects.
class ResultSource {
 public:
  ResultSource(WireContext& context, const std::string& endpoint, int held = results_held,
               const ClientAccess& access = {});
  ~ResultSource();
  ResultSource(ResultSource&&) noexcept;
  ResultSource& operator=(ResultSource&&) noexcept;
  [[nodiscard]] std::optional<Message> receive(std::chrono::milliseconds timeout) noexcept;
  [[nodiscard]] Link link() noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};
}  // namespace lbea::wire
