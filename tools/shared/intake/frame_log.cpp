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

void FrameLog::log(const wire::WireResult& result) { log(result.status, result.session, {result.frame_id, 1}); }

void FrameLog::log(wire::WireStatus status, std::uint64_t session, IdRange ids) {
  log_session(status, session, ids.first);
  if (status == wire::WireStatus::end_of_stream) {
    spdlog::info("end of stream before frame {} of session {:016x}", ids.first, session);
  } else if (status != wire::WireStatus::ok) {
    log_problem(status, ids);
  }
}

void FrameLog::log_problem(wire::WireStatus status, IdRange ids) {
  LogLine& line = by_status_[static_cast<std::size_t>(status)];
  if (!line.is_due(ids.count)) return;
  const std::string what = is_identified(status) ? frames_text(ids) : "a message";
  spdlog::warn("{}: {}: {}{}", what, wire::to_string(status), wire::explain(status), line.suppressed_text());
}

void FrameLog::log_session(wire::WireStatus status, std::uint64_t session, std::uint64_t id) {
  if (!is_identified(status) || session == session_) return;
  session_ = session;
  if (new_sessions_.is_due()) spdlog::info("frame {}: from session {:016x}", id, session);
}

void FrameLog::log(const std::vector<wire::WireSender>& senders) {
  for (const wire::WireSender& sender : senders) {
    const auto known = std::ranges::find(known_, sender.session, &wire::WireSender::session);
    const auto before = known == known_.end() ? wire::SenderCondition::active : known->condition;
    if (sender.condition == before) continue;
    if (sender.condition == wire::SenderCondition::silent)
      spdlog::warn("session {:016x} is silent after frame {} without goodbye; is its program alive?", sender.session,
                   sender.next_id - 1);
    else if (before == wire::SenderCondition::silent)
      spdlog::info("session {:016x} is back, next frame {}", sender.session, sender.next_id);
  }
  known_ = senders;
}

void warn_of_unfinished(const std::vector<wire::WireSender>& senders) {
  for (const wire::WireSender& sender : senders)
    if (sender.condition != wire::SenderCondition::ended && sender.next_id > sender.first_id)
      spdlog::warn(
          "session {:016x} did not say goodbye: its captures are accounted for up to id {}; later ones are unknown",
          sender.session, sender.next_id - 1);
}

}  // namespace lbea::tool
