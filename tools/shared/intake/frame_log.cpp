#include "tools/shared/intake/frame_log.hpp"

#include "tools/shared/answer/test_answer.hpp"
#include "tools/shared/intake/log.hpp"

#include <cmath>

namespace lbea::tool {
namespace {

/// Whether session and id of the message could be read.
bool is_identified(wire::WireStatus status) {
  return status != wire::WireStatus::wrong_kind && status != wire::WireStatus::damaged &&
         status != wire::WireStatus::message_too_large;
}

constexpr auto log_interval = std::chrono::seconds(1);

std::string from(const std::string& address) { return address.empty() ? "" : " from " + address; }

}  // namespace

FrameLog::FrameLog(const std::string& rig) : prefix_(rig_prefix(rig)) {}

std::string frames_text(IdRange ids) {
  if (ids.count == 1) return "frame " + std::to_string(ids.first);
  return "frames " + std::to_string(ids.first) + " to " + std::to_string(ids.first + (ids.count - 1));
}

void FrameLog::note(wire::WireStatus status, std::uint64_t session, IdRange ids) noexcept {
  if (is_identified(status) && std::exchange(noted_session_, session) != session)
    push({Event::Kind::new_session, status, session, ids, 0});
  if (status != wire::WireStatus::ok) push({Event::Kind::status, status, session, ids, 0});
}

void FrameLog::write() {
  for (; const Event* event = events_.front(); events_.release()) write(*event);
  const std::uint64_t lost = without_room_.exchange(0);
  if (lost > 0 && without_room_line_.is_due(lost))
    log_warning("{} further events came too fast for the log; the counters include them{}", lost,
                without_room_line_.suppressed_text());
}

void FrameLog::write(const Event& event) {
  if (event.kind == Event::Kind::refusal) {
    write_refusal(event.ids);
  } else if (event.kind == Event::Kind::low_coverage) {
    if (LogLine& line = low_coverage_[event.of]; line.is_due())
      log_warning("frame {}: {}{}{}{}", event.ids.first, event.of, event.of.empty() ? "" : ": ",
                  pose_warning(event.number, event.rig), line.suppressed_text());
  } else if (event.kind == Event::Kind::departed_points) {
    if (LogLine& line = departures_[event.of]; line.is_due())
      log_warning("frame {}: {}{}{}{}", event.ids.first, event.of, event.of.empty() ? "" : ": ",
                  departure_warning(event.number), line.suppressed_text());
  } else if (event.kind == Event::Kind::wrong_times) {
    if (wrong_times_.is_due())
      log_warning("frame {}: {}{}", event.ids.first, capture_times_warning(event.times),
                  wrong_times_.suppressed_text());
  } else if (event.kind == Event::Kind::contradiction) {
    log_warning("capture {}: {}", event.ids.first, contradiction_warning());
  } else if (event.kind == Event::Kind::unused_rig) {
    log_warning("capture {}: {}", event.ids.first, unused_rig_warning(event.unused));
  } else if (event.kind == Event::Kind::far_stamp) {
    if (far_stamps_.is_due())
      log_warning(
          "frame {}: its stamp is {:.3g} s {} --trigger-ns, far outside the simulations; are both in ns of the "
          "sender's clock?{}",
          event.ids.first, std::abs(event.number), event.number < 0 ? "before" : "after",
          far_stamps_.suppressed_text());
  } else if (event.kind == Event::Kind::clock) {
    write_clock(event);
  } else if (event.kind == Event::Kind::new_session) {
    const std::string prefix = prefix_of(event.session);
    if (by_rig_[prefix].new_sessions.is_due())
      log_info("{}frame {}: from session {:016x}", prefix, event.ids.first, event.session);
  } else if (event.status == wire::WireStatus::end_of_stream) {
    log_info("{}end of stream before frame {} of session {:016x}", prefix_of(event.session), event.ids.first,
             event.session);
  } else {
    write_problem(event);
  }
}

void FrameLog::write_clock(const Event& event) {
  if (event.number == 0)
    log_info("capture {}: rig {}: its clock agrees with the first rig's again", event.ids.first, event.of);
  else
    log_warning(
        "capture {}: rig {}: by the impact, its clock is {:.1f} ms {} the first rig's, and its stamps are corrected; "
        "synchronize "
        "the clocks before the next test",
        event.ids.first, event.of, std::abs(event.number), event.number > 0 ? "behind" : "ahead of");
}

void FrameLog::write_refusal(IdRange ids) {
  if (!refusals_.is_due(ids.count)) return;
  log_warning(
      "{}{}: refused: recorded, but not forwarded: the matcher is absent, does not know this program's key, or has no "
      "room{}",
      prefix_, frames_text(ids), refusals_.suppressed_text());
}

void FrameLog::write_problem(const Event& event) {
  const std::string prefix = prefix_of(event.session);
  LogLine& line = by_rig_[prefix].by_status[static_cast<std::size_t>(event.status)];
  if (!line.is_due(event.ids.count)) return;
  const std::string what = is_identified(event.status) ? frames_text(event.ids) : "a message";
  log_warning("{}{}: {}: {}{}", prefix, what, wire::to_string(event.status), wire::explain(event.status),
              line.suppressed_text());
}

std::string FrameLog::prefix_of(std::uint64_t session) const {
  const auto sender = std::ranges::find(known_, session, &wire::WireSender::session);
  return sender == known_.end() || sender->rig.empty() ? prefix_ : rig_prefix(sender->rig);
}

void FrameLog::write(const std::vector<wire::WireSender>& senders) {
  for (const wire::WireSender& sender : senders) {
    const auto known = std::ranges::find(known_, sender.session, &wire::WireSender::session);
    const auto before = known == known_.end() ? wire::SenderCondition::active : known->condition;
    if (sender.condition == before) continue;
    if (sender.condition == wire::SenderCondition::silent)
      log_warning("session {:016x} is silent {} without goodbye; is its program alive?", sender.session,
                  sender.next_id > sender.first_id ? "after frame " + std::to_string(sender.next_id - 1)
                                                   : "before its first frame");
    else if (before == wire::SenderCondition::silent)
      log_info("session {:016x} is back, next frame {}", sender.session, sender.next_id);
  }
  known_ = senders;
}

void FrameLog::write(const wire::Counters& counters) {
  if (counters.interleaved == known_returns_ || !alternations_.is_due()) return;
  known_returns_ = counters.interleaved;
  log_warning(
      "{}frames of different senders alternate ({} returns to an earlier one): their tests are mixed; stop all senders "
      "but "
      "one, or give lbea-serve --one-sender",
      prefix_, counters.interleaved);
}

void warn_of_unfinished(const std::vector<wire::WireSender>& senders) {
  for (const wire::WireSender& sender : senders)
    if (sender.condition != wire::SenderCondition::ended && sender.next_id > sender.first_id)
      log_warning(
          "session {:016x} did not say goodbye: its captures are accounted for up to id {}; later ones are unknown",
          sender.session, sender.next_id - 1);
}

void PeerLog::poll(Clock::time_point now) {
  using enum wire::PeerVisit::Answer;
  if (now < next_) return;
  next_ = now + log_interval;
  std::string stranger, offender;
  for (const wire::PeerVisit& visit : visits_()) {
    if (visit.answer == admitted && !visit.name.empty())
      log_info("{}: {} connected{}", endpoint_, visit.name, from(visit.address));
    if (visit.answer == unknown) stranger = ", one of them" + from(visit.address);
    if (visit.answer == offending)
      offender = "; the last one, " + (visit.name.empty() ? "unnamed" : visit.name) + from(visit.address) + ", sent " +
                 visit.offense;
  }
  const wire::PeerCounts counts = counts_();
  const auto warn = [&](std::uint64_t wire::PeerCounts::*count, const char* action, const std::string& which) {
    if (counts.*count > logged_.*count)
      log_warning("{}: {} {} connections {}", endpoint_, action, counts.*count - logged_.*count, which);
  };
  warn(&wire::PeerCounts::unknown, "refused", "without an allowed key (--allow)" + stranger);
  warn(&wire::PeerCounts::excess, "refused", "beyond --max-peers");
  warn(&wire::PeerCounts::crowded, "refused", "because few descriptors are left (ulimit -n)");
  warn(&wire::PeerCounts::malformed, "ended", "that did not speak ZeroMQ's protocol");
  warn(&wire::PeerCounts::offending, "cut off", "whose peers broke a limit" + offender);
  logged_ = counts;
}

void warn_of_unbounded_peers() {
  if (!wire::has_peer_bounds())
    log_warning("built with the system's libzmq: one peer can end this program or use up its memory");
}

}  // namespace lbea::tool
