#include "tools/serve/vigil.hpp"

#include <spdlog/spdlog.h>

namespace lbea::tool {
namespace {
constexpr std::array<const char*, 3> thread_names{"receiving", "matching", "publishing"};
constexpr auto longest_absence = std::chrono::seconds(1);
}  // namespace

bool Vigil::look(Clock::time_point now) {
  const Pipeline::Rounds rounds = pipeline_.rounds();
  std::size_t absent = 0;
  while (absent < rounds.size() && rounds[absent] != seen_[absent]) ++absent;
  const bool all_came = absent == rounds.size();
  if (all_came) {
    if (has_warned_) spdlog::info("all threads come round again");
    seen_ = rounds;
    since_ = now;
    has_warned_ = false;
  } else if (now - since_ > longest_absence && !has_warned_) {
    has_warned_ = true;
    spdlog::error(
        "the {} thread has not come round for a second; {}", thread_names[absent],
        absent == 1 ? "it is stuck in frame " + std::to_string(pipeline_.frame_in_work()) : "see what it waits for");
  }
  return all_came;
}

}  // namespace lbea::tool
