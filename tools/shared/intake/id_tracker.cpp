#include "tools/shared/intake/id_tracker.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {
constexpr std::size_t max_sessions = 64;
constexpr std::size_t max_gaps = 64;  // remembered per session
constexpr std::uint64_t max_earlier = 1024;
constexpr std::uint64_t no_id = ~std::uint64_t{0};  // has no successor
}  // namespace

IdTracker::Observation IdTracker::observe(std::uint64_t id_of_session, std::uint64_t id, Clock::time_point now) {
  Session* known = find(id_of_session);
  if (id == no_id || (known != nullptr && id > known->sender.next_id && id - known->sender.next_id >= max_jump))
    return {Arrival::impossible, {}};
  const bool had_ended = known != nullptr && known->sender.condition == wire::SenderCondition::ended;
  Session& session = session_of(id_of_session, id, now);
  if (known == nullptr) session.earliest = id - std::min(id, max_earlier);
  wire::WireSender& sender = session.sender;
  const bool is_kept = enter_test(session, had_ended, now);
  if (id < sender.next_id) {
    const Observation late = observe_late(session, id);
    return {late.arrival, late.gap, is_kept};
  }
  const IdRange gap = advance(session, id);
  sender.next_id = id + 1;
  ++sender.received;
  return {Arrival::in_order, gap, is_kept};
}

bool IdTracker::enter_test(Session& session, bool had_ended, Clock::time_point now) {
  if (session.sender.session == test_) return session.has_test = true;
  const Session* const other = find(test_);
  const bool is_running = other != nullptr && other->sender.condition != wire::SenderCondition::ended;
  if (is_running && one_sender_timeout_ && now - other->last_message <= *one_sender_timeout_) return false;
  if (session.has_test && (is_running || !had_ended)) ++interleaved_;
  test_ = session.sender.session;
  return session.has_test = true;
}

IdTracker::Observation IdTracker::observe_late(Session& session, std::uint64_t id) {
  wire::WireSender& sender = session.sender;
  IdRange gap;
  if (remove_missing(session, id)) {
    --missed_;
    --sender.missed;
  } else if (id >= session.earliest && id < sender.first_id) {
    const std::uint64_t former = std::exchange(sender.first_id, id);
    gap = add_gap(session, {id + 1, former - id - 1});
  } else {
    ++duplicates_;
    return {Arrival::duplicate, {}};
  }
  ++sender.received;
  ++reordered_;
  return {Arrival::late, gap};
}

IdRange IdTracker::add_gap(Session& session, IdRange gap) {
  if (gap.count == 0) return {};
  missed_ += gap.count;
  session.sender.missed += gap.count;
  auto& missing = session.missing;
  missing.insert(std::ranges::upper_bound(missing, gap.first, {}, &IdRange::first), gap);
  if (missing.size() > max_gaps) missing.erase(missing.begin());
  return gap;
}

IdTracker::Report IdTracker::report(const wire::Control& control, Clock::time_point now) {
  const Session* known = find(control.session);
  const bool is_far = known != nullptr && control.next_id > known->sender.next_id &&
                      control.next_id - known->sender.next_id >= max_jump;
  if (control.withheld >= max_jump || is_far) return {{}, {}, false};
  const std::uint64_t first_withheld = control.next_id - control.withheld;
  Session& session = session_of(control.session, first_withheld, now);
  wire::WireSender& sender = session.sender;
  session.sends_control = true;
  if (control.kind == wire::ControlKind::goodbye) sender.condition = wire::SenderCondition::ended;
  if (control.next_id <= sender.next_id) return {};
  Report report;
  if (first_withheld > sender.next_id) report.gap = advance(session, first_withheld);
  report.withheld = {sender.next_id, control.next_id - sender.next_id};
  sender.next_id = control.next_id;
  sender.withheld += report.withheld.count;
  withheld_ += report.withheld.count;
  return report;
}

IdRange IdTracker::advance(Session& session, std::uint64_t id) {
  const std::uint64_t first = std::exchange(session.sender.next_id, id);
  return add_gap(session, {first, id - first});
}

bool IdTracker::remove_missing(Session& session, std::uint64_t id) {
  auto& missing = session.missing;
  const auto gap = std::find_if(missing.begin(), missing.end(),
                                [&](const IdRange& g) { return id >= g.first && id - g.first < g.count; });
  if (gap == missing.end()) return false;
  const IdRange before{gap->first, id - gap->first};
  const IdRange after{id + 1, gap->count - before.count - 1};
  auto at = missing.erase(gap);
  if (after.count > 0) at = missing.insert(at, after);
  if (before.count > 0) missing.insert(at, before);
  return true;
}

IdTracker::Session* IdTracker::find(std::uint64_t session) noexcept {
  const auto found = std::ranges::find(recent_, session, [](const Session& s) { return s.sender.session; });
  return found == recent_.end() ? nullptr : &*found;
}

IdTracker::Session& IdTracker::session_of(std::uint64_t session, std::uint64_t first_id, Clock::time_point now) {
  Session* found = find(session);
  if (found == nullptr) {
    ++sessions_;
    if (recent_.size() < max_sessions) {
      found = &recent_.emplace_back();
    } else {
      found = &*std::ranges::min_element(recent_, {}, &Session::last_use);
      *found = {};
    }
    found->sender.session = session;
    found->sender.first_id = found->sender.next_id = found->earliest = first_id;
  }
  found->last_use = ++uses_;
  found->last_message = now;
  found->sender.condition = wire::SenderCondition::active;
  return *found;
}

wire::WireStatus status_after(IdTracker::Arrival arrival, wire::WireStatus status) noexcept {
  if (arrival == IdTracker::Arrival::impossible) return wire::WireStatus::damaged;
  const bool is_duplicate = arrival == IdTracker::Arrival::duplicate && status == wire::WireStatus::ok;
  return is_duplicate ? wire::WireStatus::duplicate : status;
}

std::vector<wire::WireSender> IdTracker::senders(Clock::time_point now, Clock::duration timeout) const {
  std::vector<wire::WireSender> senders;
  for (const Session& session : recent_) {
    senders.push_back(session.sender);
    const bool is_active = senders.back().condition == wire::SenderCondition::active;
    if (is_active && session.sends_control && now - session.last_message > timeout)
      senders.back().condition = wire::SenderCondition::silent;
  }
  return senders;
}

}  // namespace lbea::tool
