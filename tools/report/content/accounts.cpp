#include "tools/report/content/accounts.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

std::vector<Accounts::Reason> reasons(const wire::Counters& counters, wire::Fate fate) {
  std::vector<Accounts::Reason> reasons;
  for (std::size_t i = 0; i < wire::wire_status_count; ++i)
    if (const auto status = static_cast<wire::WireStatus>(i); wire::fate_of(status) == fate && counters.of(status) > 0)
      reasons.push_back({status, counters.of(status)});
  return reasons;
}

/// Of a recording without a matcher's counters.
wire::Counters counted(const RunAudit& audit) {
  wire::Counters counters;
  for (std::size_t i = 0; i < wire::wire_status_count; ++i) {
    const auto found = audit.results_by_status.find(std::string(wire::to_string(static_cast<wire::WireStatus>(i))));
    if (found != audit.results_by_status.end()) counters.by_status[i] = found->second;
  }
  const std::uint64_t absent = counters.of(wire::WireStatus::missed) + counters.of(wire::WireStatus::withheld);
  if (audit.missing() > absent)
    counters.by_status[static_cast<std::size_t>(wire::WireStatus::missed)] += audit.missing() - absent;
  const std::uint64_t answered = counters.sum(wire::Fate::matched) + counters.sum(wire::Fate::rejected) +
                                 counters.sum(wire::Fate::dropped) - counters.of(wire::WireStatus::missed) -
                                 counters.of(wire::WireStatus::withheld);
  counters.received = std::max(audit.frames, answered);
  return counters;
}

}  // namespace

Accounts accounts_of(const wire::Counters& counters) {
  return {counters, false, reasons(counters, wire::Fate::rejected), reasons(counters, wire::Fate::dropped)};
}

Accounts accounts_of(const RunAudit& audit) {
  Accounts accounts = accounts_of(audit.counters ? *audit.counters : counted(audit));
  accounts.is_by_matcher = audit.counters.has_value();
  return accounts;
}

}  // namespace lbea::tool
