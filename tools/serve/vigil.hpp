// Whether the pipeline lives: its threads come round, not merely exist.
#pragma once

#include "tools/serve/pipeline.hpp"

namespace lbea::tool {

class Vigil {
 public:
  using Clock = std::chrono::steady_clock;
  explicit Vigil(const Pipeline& pipeline) : pipeline_(pipeline), seen_(pipeline.rounds()), since_(Clock::now()) {}
  /// Every now and then. True when every thread has come round since it was last true; writes a log line when one has
  /// not for a second, and when it is back.
  bool look(Clock::time_point now);

 private:
  const Pipeline& pipeline_;
  Pipeline::Rounds seen_;
  Clock::time_point since_;
  bool has_warned_ = false;
};

}  // namespace lbea::tool
