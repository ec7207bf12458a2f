#include "tools/serve/supervision.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {

constexpr std::array<const char*, 3> thread_names{"receiving", "matching", "publishing"};
constexpr auto max_stall = std::chrono::seconds(1);
constexpr auto log_interval = std::chrono::seconds(1);

std::string from(const std::string& address) { return address.empty() ? "" : " from " + address; }

}  // namespace

bool Watchdog::poll(Clock::time_point now) {
  const Pipeline::Rounds rounds = pipeline_.rounds();
  std::size_t stalled = 0;
  while (stalled < rounds.size() && rounds[stalled] != seen_[stalled]) ++stalled;
  const bool all_advanced = stalled == rounds.size();
  if (all_advanced) {
    if (has_warned_) spdlog::info("all threads advance again");
    seen_ = rounds;
    since_ = now;
    has_warned_ = false;
  } else if (now - since_ > max_stall && !has_warned_) {
    has_warned_ = true;
    spdlog::error(
        "the {} thread has not advanced for a second; {}", thread_names[stalled],
        stalled == 1 ? "it is matching frame " + std::to_string(pipeline_.current_frame()) : "check what it waits for");
  }
  return all_advanced;
}

void PeerLog::poll(std::chrono::steady_clock::time_point now) {
  if (now < next_) return;
  next_ = now + log_interval;
  log("frames", pipeline_.frame_visits(), pipeline_.frame_peers(), frames_logged_);
  log("results", pipeline_.result_visits(), pipeline_.result_peers(), results_logged_);
}

void PeerLog::log(const char* endpoint, const std::vector<wire::PeerVisit>& visits, const wire::PeerCounts& counts,
                  wire::PeerCounts& logged) {
  std::string refused;
  for (const wire::PeerVisit& visit : visits) {
    if (visit.answer == wire::PeerVisit::Answer::admitted && !visit.name.empty())
      spdlog::info("{}: {} connected{}", endpoint, visit.name, from(visit.address));
    if (visit.answer == wire::PeerVisit::Answer::unknown) refused = from(visit.address);
  }
  const std::uint64_t unknown = counts.unknown - logged.unknown, excess = counts.excess - logged.excess,
                      malformed = counts.malformed - logged.malformed;
  logged = counts;
  if (unknown > 0)
    spdlog::warn("{}: refused {} connections without an allowed key (--allow){}", endpoint, unknown,
                 refused.empty() ? "" : ", one of them" + refused);
  if (excess > 0) spdlog::warn("{}: refused {} connections beyond --max-peers", endpoint, excess);
  if (malformed > 0) spdlog::warn("{}: {} connections ended without speaking ZeroMQ's protocol", endpoint, malformed);
}

}  // namespace lbea::tool
