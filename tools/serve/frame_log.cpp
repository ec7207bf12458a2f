#include "tools/serve/frame_log.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

namespace lbea {

namespace {
constexpr auto interval = std::chrono::seconds(1);

std::string untold_text(std::uint64_t untold) {
  return untold == 0 ? std::string() : " (and " + std::to_string(untold) + " more since the last such line)";
}

/// Whether session and id of the message could be read.
bool is_identified(WireStatus status) {
  return status != WireStatus::wrong_kind && status != WireStatus::damaged &&
         status != WireStatus::message_too_large;
}
}  // namespace

void FrameLog::note(const WireResult& result) {
  note_session(result);
  if (result.status == WireStatus::end_of_stream) {
    spdlog::info("end of stream before frame {} of session {:016x}", result.frame_id, result.session);
  } else if (result.status != WireStatus::ok) {
    note_trouble(result);
  }
}

bool FrameLog::may_speak(Line& line) {
  const auto now = Clock::now();
  if (line.last != Clock::time_point{} && now - line.last < interval) {
    ++line.untold;
    return false;
  }
  line.last = now;
  return true;
}

void FrameLog::note_trouble(const WireResult& result) {
  Line& line = by_status_[static_cast<std::size_t>(result.status)];
  if (!may_speak(line)) return;
  const std::string what =
      is_identified(result.status) ? "frame " + std::to_string(result.frame_id) : "a message";
  spdlog::warn("{}: {}: {}{}", what, to_string(result.status), explain(result.status),
               untold_text(std::exchange(line.untold, 0)));
}

void FrameLog::note_session(const WireResult& result) {
  if (!is_identified(result.status) || result.session == session_) return;
  session_ = result.session;
  if (may_speak(senders_)) spdlog::info("frame {}: from session {:016x}", result.frame_id, result.session);
}

void FrameLog::note(const WireState& state) {
  for (const WireSender& sender : state.senders) {
    const auto known = std::find_if(known_.begin(), known_.end(),
                                    [&](const WireSender& k) { return k.session == sender.session; });
    const auto before = known == known_.end() ? SenderCondition::active : known->condition;
    if (sender.condition == before) continue;
    if (sender.condition == SenderCondition::silent)
      spdlog::warn("session {:016x} is silent after frame {} without goodbye; is its program alive?",
                   sender.session, sender.next_id - 1);
    else if (before == SenderCondition::silent)
      spdlog::info("session {:016x} is back, next frame {}", sender.session, sender.next_id);
  }
  known_ = state.senders;
}

}  // namespace lbea
