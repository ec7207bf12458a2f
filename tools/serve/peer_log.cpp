#include "tools/serve/peer_log.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {

constexpr auto interval = std::chrono::seconds(1);

/// For people: an address where there is one.
std::string from(const std::string& address) { return address.empty() ? "" : " from " + address; }

}  // namespace

void PeerLog::look(std::chrono::steady_clock::time_point now) {
  if (now < next_) return;
  next_ = now + interval;
  tell("frames", pipeline_.frame_visits(), pipeline_.frame_peers(), frames_told_);
  tell("results", pipeline_.result_visits(), pipeline_.result_peers(), results_told_);
}

void PeerLog::tell(const char* endpoint, const std::vector<wire::PeerVisit>& visits, const wire::PeerCounts& counts,
                   wire::PeerCounts& told) {
  std::string stranger;
  for (const wire::PeerVisit& visit : visits) {
    if (visit.answer == wire::PeerVisit::Answer::admitted && !visit.name.empty())
      spdlog::info("{}: {} came in{}", endpoint, visit.name, from(visit.address));
    if (visit.answer == wire::PeerVisit::Answer::unknown) stranger = from(visit.address);
  }
  const std::uint64_t unknown = counts.unknown - told.unknown, excess = counts.excess - told.excess,
                      malformed = counts.malformed - told.malformed;
  told = counts;
  if (unknown > 0)
    spdlog::warn("{}: turned away {} without a key that is allowed (--allow){}", endpoint, unknown,
                 stranger.empty() ? "" : ", one of them" + stranger);
  if (excess > 0) spdlog::warn("{}: turned away {} because as many as --max-peers allows are there", endpoint, excess);
  if (malformed > 0) spdlog::warn("{}: {} connections ended without a word of ZeroMQ's protocol", endpoint, malformed);
}

}  // namespace lbea::tool
