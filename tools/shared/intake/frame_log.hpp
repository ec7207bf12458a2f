// The operator's log while frames arrive: at most one line per kind of problem and second.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/cli/log_line.hpp"
#include "tools/shared/intake/channel.hpp"
#include "tools/shared/intake/id_tracker.hpp"

namespace lbea::tool {

/// "frame 7", "frames 7 to 9".
[[nodiscard]] std::string frames_text(IdRange ids);

class FrameLog {
 public:
  // The thread that receives or publishes. Neither function blocks or allocates; what finds no room is counted.
  /// The status of these captures.
  void note(wire::WireStatus status, std::uint64_t session, IdRange ids) noexcept;
  /// The matcher had no room for these frames.
  void note_refusal(std::uint64_t session, IdRange ids) noexcept;

  /// A frame covers little of the undeformed component.
  void note_low_coverage(std::uint64_t session, std::uint64_t id, float coverage) noexcept;

  // Another thread.
  /// Logs what was noted since the last call.
  void write();
  /// The latest list of senders.
  void write(const std::vector<wire::WireSender>& senders);
  /// Warns when the frames of senders alternate.
  void write(const wire::Counters& counters);

 private:
  struct Event {
    enum class Kind : std::uint8_t { new_session, status, refusal, low_coverage };
    Kind kind = Kind::status;
    wire::WireStatus status = wire::WireStatus::ok;
    std::uint64_t session = 0;
    IdRange ids;
    float coverage = 0;
  };
  void push(const Event& event) noexcept;
  void write(const Event& event);
  void write_refusal(IdRange ids);
  void write_problem(wire::WireStatus status, IdRange ids);

  Channel<Event> events_{1024};
  std::atomic<std::uint64_t> without_room_{0};
  std::uint64_t noted_session_ = 0;
  std::array<LogLine, wire::wire_status_count> by_status_{};  // from here on: the writing thread's
  LogLine new_sessions_, refusals_, low_coverage_, without_room_line_, alternations_;
  std::uint64_t known_returns_ = 0;
  std::vector<wire::WireSender> known_;
};

/// At the end of a run: logs a warning for each sender that did not say goodbye.
void warn_of_unfinished(const std::vector<wire::WireSender>& senders);

}  // namespace lbea::tool
