#include "tools/serve/sender_accounts.hpp"

#include <algorithm>
#include <utility>

namespace lbea::tool {
namespace {
constexpr std::chrono::milliseconds senders_interval{100};  // how old what others are told of the senders may be
}

IdTracker::Arrival SenderAccounts::observe(std::uint64_t session, std::uint64_t id, std::int64_t receive_ns) noexcept {
  const IdTracker::Observation seen = ids_.observe(session, id, Clock::now());
  handover_.counters.store(ids_);
  announcer_.announce(wire::WireStatus::missed, session, seen.gap, receive_ns);
  return seen.arrival;
}

bool SenderAccounts::report(const wire::Control& control, std::int64_t receive_ns) noexcept {
  const auto now = Clock::now();
  const IdTracker::Report report = ids_.report(control, now);
  if (!report.is_possible) return false;
  handover_.counters.store(ids_);
  announcer_.announce(wire::WireStatus::missed, control.session, report.gap, receive_ns);
  announcer_.announce(wire::WireStatus::withheld, control.session, report.withheld, receive_ns);
  if (control.kind != wire::ControlKind::heartbeat) show(now, patience_);
  return true;
}

void SenderAccounts::show_when_due() noexcept {
  if (const auto now = Clock::now(); now >= next_show_) show(now, patience_);
}

void SenderAccounts::show(Clock::time_point now, Clock::duration patience) noexcept {
  next_show_ = now + senders_interval;
  auto senders = ids_.senders(now, patience);
  handover_.counters.store_silent(
      static_cast<std::uint64_t>(std::count_if(senders.begin(), senders.end(), [](const wire::WireSender& s) {
        return s.condition == wire::SenderCondition::silent;
      })));
  handover_.senders.store(std::move(senders));
}

}  // namespace lbea::tool
