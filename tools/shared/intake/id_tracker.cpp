#include "tools/shared/intake/id_tracker.hpp"

#include <algorithm>
#include <tuple>

namespace lbea::tool {
namespace {
constexpr std::size_t max_gaps = 64;  // remembered per session
constexpr std::uint64_t max_earlier = 1024;
constexpr std::uint64_t no_id = ~std::uint64_t{0};  // has no successor
}  // namespace

IdTracker::Observation IdTracker::observe(std::uint64_t id_of_session, std::uint64_t id, Clock::time_point now) {
  Session* known = find(id_of_session);
  if (id == no_id || (known != nullptr && id > known->sender.next_id && id - known->sender.next_id >= max_jump))
    return {Arrival::impossible, {}};
  Session& session = session_of(id_of_session, id, now);
  if (known == nullptr) session.earliest = id - std::min(id, max_earlier);
  wire::WireSender& sender = session.sender;
  if (id < sender.next_id) return observe_late(session, id);
  const IdRange gap = advance(session, id);
  sender.next_id = id + 1;
  ++sender.received;
  return {Arrival::in_order, gap};
}

bool IdTracker::enter_test(std::uint64_t id_of_session, Clock::time_point now) {
  Session* const session = find(id_of_session);
  if (session == nullptr) return true;
  const Session* const other = id_of_session == test_ ? nullptr : find(test_);
  const bool is_running = other != nullptr && !other->has_ended;
  if (is_running && one_sender_timeout_ && now - other->last_message <= *one_sender_timeout_) return false;
  if (id_of_session != test_ && session->has_test && (is_running || !session->has_ended)) ++interleaved_;
  test_ = id_of_session;
  session->has_ended = false;
  return session->has_test = true;
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
  if (control.kind == wire::ControlKind::goodbye) {
    sender.condition = wire::SenderCondition::ended;
    session.has_ended = true;
  }
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
  if (missing.size() > max_gaps) missing.erase(missing.begin());
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
      // A crowd of made-up sessions does not displace those that sent frames.
      found = &*std::ranges::min_element(recent_, {}, [this](const Session& s) {
        return std::tuple(s.has_test && s.sender.session == test_, s.sender.received > 0, s.last_use);
      });
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
