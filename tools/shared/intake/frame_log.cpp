#include "tools/shared/intake/frame_log.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace lbea::tool {
namespace {

/// Whether session and id of the message could be read.
bool is_identified(wire::WireStatus status) {
  return status != wire::WireStatus::wrong_kind && status != wire::WireStatus::damaged &&
         status != wire::WireStatus::message_too_large;
}

}  // namespace

std::string frames_text(IdRange ids) {
  if (ids.count == 1) return "frame " + std::to_string(ids.first);
  return "frames " + std::to_string(ids.first) + " to " + std::to_string(ids.first + (ids.count - 1));
}

void FrameLog::note(const wire::WireResult& result) { note(result.status, result.session, {result.frame_id, 1}); }

void FrameLog::note(wire::WireStatus status, std::uint64_t session, IdRange ids) {
  note_session(status, session, ids.first);
  if (status == wire::WireStatus::end_of_stream) {
    spdlog::info("end of stream before frame {} of session {:016x}", ids.first, session);
  } else if (status != wire::WireStatus::ok) {
    note_trouble(status, ids);
  }
}

void FrameLog::note_trouble(wire::WireStatus status, IdRange ids) {
  LogLine& line = by_status_[static_cast<std::size_t>(status)];
  if (!line.may_speak(ids.count)) return;
  const std::string what = is_identified(status) ? frames_text(ids) : "a message";
  spdlog::warn("{}: {}: {}{}", what, wire::to_string(status), wire::explain(status), line.untold_text());
}

void FrameLog::note_session(wire::WireStatus status, std::uint64_t session, std::uint64_t id) {
  if (!is_identified(status) || session == session_) return;
  session_ = session;
  if (senders_.may_speak()) spdlog::info("frame {}: from session {:016x}", id, session);
}

void FrameLog::note(const wire::WireState& state) {
  for (const wire::WireSender& sender : state.senders) {
    const auto known = std::find_if(known_.begin(), known_.end(),
                                    [&](const wire::WireSender& k) { return k.session == sender.session; });
    const auto before = known == known_.end() ? wire::SenderCondition::active : known->condition;
    if (sender.condition == before) continue;
    if (sender.condition == wire::SenderCondition::silent)
      spdlog::warn("session {:016x} is silent after frame {} without goodbye; is its program alive?", sender.session,
                   sender.next_id - 1);
    else if (before == wire::SenderCondition::silent)
      spdlog::info("session {:016x} is back, next frame {}", sender.session, sender.next_id);
  }
  known_ = state.senders;
}

}  // namespace lbea::tool
