// What the main thread watches while the pipeline runs: its threads and its peers. Both classes write log lines.
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

/// Logs admitted peers and, at most once a second, the number of refused connections.
class PeerLog {
 public:
  explicit PeerLog(Pipeline& pipeline) : pipeline_(pipeline) {}
  /// Call often.
  void poll(std::chrono::steady_clock::time_point now);

 private:
  static void log(const char* endpoint, const std::vector<wire::PeerVisit>& visits, const wire::PeerCounts& counts,
                  wire::PeerCounts& logged);

  Pipeline& pipeline_;
  std::chrono::steady_clock::time_point next_{};
  wire::PeerCounts frames_logged_, results_logged_;
};

}  // namespace lbea::tool
