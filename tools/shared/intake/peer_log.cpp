#include "tools/shared/intake/peer_log.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {

constexpr auto log_interval = std::chrono::seconds(1);

std::string from(const std::string& address) { return address.empty() ? "" : " from " + address; }

}  // namespace

void PeerLog::poll(Clock::time_point now) {
  using enum wire::PeerVisit::Answer;
  if (now < next_) return;
  next_ = now + log_interval;
  std::string stranger, offender;
  for (const wire::PeerVisit& visit : visits_()) {
    if (visit.answer == admitted && !visit.name.empty())
      spdlog::info("{}: {} connected{}", endpoint_, visit.name, from(visit.address));
    if (visit.answer == unknown) stranger = ", one of them" + from(visit.address);
    if (visit.answer == offending)
      offender = "; the last one, " + (visit.name.empty() ? "unnamed" : visit.name) + from(visit.address) + ", sent " +
                 visit.offense;
  }
  const wire::PeerCounts counts = counts_();
  const auto warn = [&](std::uint64_t wire::PeerCounts::*count, const char* action, const std::string& which) {
    if (counts.*count > logged_.*count)
      spdlog::warn("{}: {} {} connections {}", endpoint_, action, counts.*count - logged_.*count, which);
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
    spdlog::warn("built with the system's libzmq: one peer can end this program or use up its memory");
}

}  // namespace lbea::tool
