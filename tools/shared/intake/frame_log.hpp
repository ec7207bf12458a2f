// The operator's log while frames arrive: at most one line per kind of problem and second; and the log of the peers.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/shared/answer/test_warnings.hpp"
#include "tools/shared/intake/channel.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <functional>
#include <map>
#include <string_view>

namespace lbea::tool {

/// "frame 7", "frames 7 to 9".
[[nodiscard]] std::string frames_text(IdRange ids);

/// A log line that is written at most once a second.
class LogLine {
 public:
  /// Whether to write the line now, for `times` occurrences. Otherwise they are counted for the next line.
  [[nodiscard]] bool is_due(std::uint64_t times = 1) {
    const auto now = Clock::now();
    if (last_ != Clock::time_point{} && now - last_ < interval) {
      suppressed_ += times;
      return false;
    }
    last_ = now;
    return true;
  }
  /// " (and 7 more since the last such line)"; empty when there are none.
  [[nodiscard]] std::string suppressed_text() {
    const std::uint64_t suppressed = std::exchange(suppressed_, 0);
    return suppressed == 0 ? std::string() : " (and " + std::to_string(suppressed) + " more since the last such line)";
  }

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr auto interval = std::chrono::seconds(1);
  Clock::time_point last_{};
  std::uint64_t suppressed_ = 0;
};

class FrameLog {
 public:
  /// rig: one of several, whose name begins the lines about its frames; else empty.
  explicit FrameLog(const std::string& rig = {});
  // The thread that receives or publishes. Neither function blocks or allocates; what finds no room is counted.
  /// The status of these captures.
  void note(wire::WireStatus status, std::uint64_t session, IdRange ids) noexcept;
  /// The matcher had no room for these frames.
  void note_refusal(std::uint64_t session, IdRange ids) noexcept {
    push({Event::Kind::refusal, wire::WireStatus::ok, session, ids, 0});
  }

  /// A frame covers little of the undeformed component. component, rig: of several, else empty; they must remain valid.
  void note_low_coverage(std::string_view component, std::string_view rig, std::uint64_t session, std::uint64_t id,
                         float coverage) noexcept {
    push({.kind = Event::Kind::low_coverage,
          .session = session,
          .ids = {id, 1},
          .number = coverage,
          .of = component,
          .rig = rig});
  }
  /// Points of that share of the component have left the space of the simulations. component: as above.
  void note_departed_points(std::string_view component, std::uint64_t session, std::uint64_t id, float share) noexcept {
    push({Event::Kind::departed_points, wire::WireStatus::ok, session, {id, 1}, share, component});
  }
  /// Up to this frame, the stamps cannot be capture times of one test.
  void note_wrong_times(std::uint64_t session, std::uint64_t id, CaptureTimes::Problem problem) noexcept {
    push({.kind = Event::Kind::wrong_times, .session = session, .ids = {id, 1}, .times = problem});
  }
  /// Most frames of a rig are not used. The name must remain valid.
  void note_unused_rig(std::uint64_t session, std::uint64_t id, const RigUse::Unused& unused) noexcept {
    push({.kind = Event::Kind::unused_rig, .session = session, .ids = {id, 1}, .unused = unused});
  }
  /// Up to this capture, the rigs contradict each other.
  void note_contradiction(std::uint64_t session, std::uint64_t id) noexcept {
    push({.kind = Event::Kind::contradiction, .session = session, .ids = {id, 1}});
  }
  /// A frame was captured so many seconds after the impact that its stamp or --trigger-ns must be wrong.
  void note_far_stamp(std::uint64_t session, std::uint64_t id, float after_s) noexcept {
    push({Event::Kind::far_stamp, wire::WireStatus::ok, session, {id, 1}, after_s});
  }
  /// By the impact, the rig's clock is behind or ahead of the first rig's by so many ms. The name must remain valid.
  void note_clock(std::string_view rig, std::uint64_t session, std::uint64_t id, float behind_ms) noexcept {
    push({Event::Kind::clock, wire::WireStatus::ok, session, {id, 1}, behind_ms, rig});
  }

  // Another thread.
  /// Logs what was noted since the last call.
  void write();
  /// The latest list of senders, which names the rigs in later lines.
  void write(const std::vector<wire::WireSender>& senders);
  /// Warns when the frames of senders alternate.
  void write(const wire::Counters& counters);

 private:
  struct Event {
    enum class Kind : std::uint8_t {
      new_session,
      status,
      refusal,
      low_coverage,
      departed_points,
      wrong_times,
      unused_rig,
      contradiction,
      far_stamp,
      clock
    };
    Kind kind = Kind::status;
    wire::WireStatus status = wire::WireStatus::ok;
    std::uint64_t session = 0;
    IdRange ids{};
    float number = 0;       // coverage, share, seconds, or ms
    std::string_view of{};  // which rig's or component's it is
    CaptureTimes::Problem times = CaptureTimes::Problem::none;
    RigUse::Unused unused{};
    std::string_view rig{};  // whose pose may be wrong
  };
  void push(const Event& event) noexcept {
    if (!events_.push(event)) ++without_room_;
  }
  void write(const Event& event);
  void write_clock(const Event& event);
  void write_refusal(IdRange ids);
  void write_problem(const Event& event);
  /// "rig left: " for the sender of one of several rigs.
  [[nodiscard]] std::string prefix_of(std::uint64_t session) const;

  std::string prefix_;
  Channel<Event> events_{1024};
  std::atomic<std::uint64_t> without_room_{0};
  std::uint64_t noted_session_ = 0;
  struct RigLines {
    std::array<LogLine, wire::wire_status_count> by_status{};
    LogLine new_sessions;
  };
  std::map<std::string, RigLines> by_rig_;                         // by prefix; from here on: the writing thread's
  std::map<std::string_view, LogLine> low_coverage_, departures_;  // by component
  LogLine refusals_, wrong_times_, far_stamps_, without_room_line_, alternations_;
  std::uint64_t known_returns_ = 0;
  std::vector<wire::WireSender> known_;
};

/// At the end of a run: logs a warning for each sender that did not say goodbye.
void warn_of_unfinished(const std::vector<wire::WireSender>& senders);

/// Logs admitted and disconnected peers and the number of refused connections, at most once a second.
class PeerLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// `endpoint`: its name in the log. `socket`: has the functions visits() and peers().
  template <class Socket>
  PeerLog(std::string endpoint, Socket& socket)
      : endpoint_(std::move(endpoint)),
        visits_([&] { return socket.visits(); }),
        counts_([&] { return socket.peers(); }) {}
  /// Call often.
  void poll(Clock::time_point now);

 private:
  std::string endpoint_;
  std::function<std::vector<wire::PeerVisit>()> visits_;
  std::function<wire::PeerCounts()> counts_;
  Clock::time_point next_{};
  wire::PeerCounts logged_;
};

/// Warns when the program is built with a libzmq that does not survive every peer.
void warn_of_unbounded_peers();

}  // namespace lbea::tool
