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

bool ModelWatch::poll() {
  if (has_warned_ || !model_.file_was_written()) return !(has_warned_ && needs_file_);
  has_warned_ = true;
  if (needs_file_)
    spdlog::error(
        "{} was written to while frames are matched with it: the program ends, because they would be matched wrongly; "
        "replace a model by renaming another file (mv), then restart",
        file_);
  else
    spdlog::warn(
        "{} was written to: frames are still matched with the former model, but no field is inferred any more; restart "
        "to use the new model",
        file_);
  return !needs_file_;
}

}  // namespace lbea::tool
