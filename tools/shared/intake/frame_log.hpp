// The operator's log while frames arrive: at most one line per kind of problem and second.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/cli/log_line.hpp"
#include "tools/shared/intake/id_tracker.hpp"

namespace lbea::tool {

/// "frame 7", "frames 7 to 9".
[[nodiscard]] std::string frames_text(IdRange ids);

class FrameLog {
 public:
  /// A published result.
  void log(const wire::WireResult& result);
  /// The status of these captures.
  void log(wire::WireStatus status, std::uint64_t session, IdRange ids);
  /// The latest list of senders.
  void log(const std::vector<wire::WireSender>& senders);

 private:
  void log_problem(wire::WireStatus status, IdRange ids);
  void log_session(wire::WireStatus status, std::uint64_t session, std::uint64_t id);

  std::array<LogLine, wire::wire_status_count> by_status_{};
  LogLine new_sessions_;
  std::uint64_t session_ = 0;
  std::vector<wire::WireSender> known_;
};

/// At the end of a run: logs a warning for each sender that did not say goodbye.
void warn_of_unfinished(const std::vector<wire::WireSender>& senders);

}  // namespace lbea::tool
