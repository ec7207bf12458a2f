// What a pipeline is told before it starts.
#pragma once

#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/intake/run_observer.hpp"

#include <chrono>
#include <functional>

namespace lbea::tool {

struct PipelineConfig {
  wire::WireLimits limits;
  std::uint32_t queue_slots = 16;  // frames that may wait for the matcher; 1.5 MB each at 131,072 points
  std::uint32_t max_matches = MatcherConfig{}.max_matches;
  std::chrono::milliseconds state_interval{500};
  std::chrono::milliseconds sender_patience =
      IdTracker::default_sender_timeout;     // without a word a sender is silent after so long
  double stray_results_per_second = 1000;    // results for messages that are nobody's frame
  wire::WireState description;               // the unchanging part: version, method, model
  std::function<void()> on_matching_thread;  // called there once, before the first frame; may be empty
  RunObserver* observer = nullptr;           // may be absent; outlives the pipeline
};

}  // namespace lbea::tool
