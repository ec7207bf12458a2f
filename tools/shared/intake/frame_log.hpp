// What the operator reads while frames come in: one line per kind of trouble and second, however much there is.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/cli/log_line.hpp"
#include "tools/shared/intake/id_tracker.hpp"

namespace lbea::tool {

/// "frame 7", "frames 7 to 9".
[[nodiscard]] std::string frames_text(IdRange ids);

class FrameLog {
 public:
  /// A result about to be published.
  void note(const wire::WireResult& result);
  /// What became of these captures.
  void note(wire::WireStatus status, std::uint64_t session, IdRange ids);
  /// A state about to be published.
  void note(const wire::WireState& state);

 private:
  void note_trouble(wire::WireStatus status, IdRange ids);
  void note_session(wire::WireStatus status, std::uint64_t session, std::uint64_t id);

  std::array<LogLine, wire::wire_status_count> by_status_{};
  LogLine senders_;
  std::uint64_t session_ = 0;
  std::vector<wire::WireSender> known_;
};

}  // namespace lbea::tool
