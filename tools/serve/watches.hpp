// What lbea-serve watches while it runs: its threads and the files of its models.
#pragma once

#include "tools/serve/pipeline/pipeline.hpp"
#include "tools/shared/intake/log.hpp"

namespace lbea::tool {

/// Detects a thread of the pipeline that hangs.
class Watchdog {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Watchdog(const Pipeline& pipeline) : pipeline_(pipeline), seen_(pipeline.rounds()), since_(Clock::now()) {}
  /// Call often. True when every thread has advanced since it was last true. Logs an error when a thread has not
  /// advanced for a second, and when it advances again.
  bool poll(Clock::time_point now) {
    const Pipeline::Rounds rounds = pipeline_.rounds();
    std::size_t stalled = 0;
    while (stalled < rounds.size() && rounds[stalled] != seen_[stalled]) ++stalled;
    const bool all_advanced = stalled == rounds.size();
    if (all_advanced) {
      if (has_warned_) log_info("all threads advance again");
      seen_ = rounds;
      since_ = now;
      has_warned_ = false;
    } else if (now - since_ > max_stall && !has_warned_) {
      has_warned_ = true;
      log_error("the {} thread has not advanced for a second; {}", thread_names[stalled],
                stalled == 1 ? "it is matching frame " + std::to_string(pipeline_.current_frame())
                             : "check what it waits for");
    }
    return all_advanced;
  }

 private:
  static constexpr std::array<const char*, 3> thread_names{"receiving", "matching", "publishing"};
  static constexpr auto max_stall = std::chrono::seconds(1);
  const Pipeline& pipeline_;
  Pipeline::Rounds seen_;
  Clock::time_point since_;
  bool has_warned_ = false;
};

/// Notices that the model's file is written to while it is used.
class ModelWatch {
 public:
  /// `needs_file`: frames are matched with what is in the file, not with a copy.
  ModelWatch(const Model& model, std::string file, bool needs_file)
      : model_(model), file_(std::move(file)), needs_file_(needs_file) {}
  /// Call often. False when matches would be wrong from now on. Logs once what has happened.
  bool poll() {
    if (has_warned_ || !model_.file_was_written()) return !(has_warned_ && needs_file_);
    has_warned_ = true;
    if (needs_file_)
      log_error(
          "{} was written to while frames are matched with it: the program ends, because they would be matched "
          "wrongly; "
          "replace a model by renaming another file (mv), then restart",
          file_);
    else
      log_warning(
          "{} was written to: frames are still matched with the former model, but no field is inferred any more; "
          "restart "
          "to use the new model",
          file_);
    return !needs_file_;
  }

 private:
  const Model& model_;
  std::string file_;
  bool needs_file_;
  bool has_warned_ = false;
};

}  // namespace lbea::tool
