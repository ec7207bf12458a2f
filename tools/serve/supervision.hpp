// What the main thread watches while the pipeline runs.
#pragma once

#include "tools/serve/pipeline/pipeline.hpp"

namespace lbea::tool {

/// Detects a thread of the pipeline that hangs.
class Watchdog {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Watchdog(const Pipeline& pipeline) : pipeline_(pipeline), seen_(pipeline.rounds()), since_(Clock::now()) {}
  /// Call often. True when every thread has advanced since it was last true. Logs an error when a thread has not
  /// advanced for a second, and when it advances again.
  bool poll(Clock::time_point now);

 private:
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
  bool poll();

 private:
  const Model& model_;
  std::string file_;
  bool needs_file_;
  bool has_warned_ = false;
};

}  // namespace lbea::tool
