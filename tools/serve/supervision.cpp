#include "tools/serve/supervision.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {

constexpr std::array<const char*, 3> thread_names{"receiving", "matching", "publishing"};
constexpr auto max_stall = std::chrono::seconds(1);

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

}  // namespace lbea::tool
