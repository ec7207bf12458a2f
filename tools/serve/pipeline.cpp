#include "tools/serve/pipeline.hpp"

#include "tools/common/wall_clock.hpp"

#include <utility>

namespace lbea {

namespace {

/// With what the pipeline itself says in its description.
PipelineConfig described(PipelineConfig config) {
  config.description.start_ns = wall_clock_ns();
  config.description.max_points = config.limits.max_points;
  config.description.max_message_bytes = config.limits.max_message_bytes();
  config.description.queue_slots = config.queue_slots;
  return config;
}

}  // namespace

Pipeline::Pipeline(PipelineConfig config, MatchEngine& engine, FrameSource frames, ResultSink results)
    : handover_(config),
      config_(described(std::move(config))),
      receiver_(config_, std::move(frames), handover_),
      matcher_(config_, engine, handover_),
      publisher_(config_, engine, std::move(results), handover_) {
  publishing_ = std::thread(&ResultPublisher::run, &publisher_);
  matching_ = std::thread(&FrameMatcher::run, &matcher_);
  receiving_ = std::thread(&FrameReceiver::run, &receiver_);
}

Pipeline::~Pipeline() { stop(); }

void Pipeline::stop() {
  receiver_.stop();
  for (std::thread* thread : {&receiving_, &matching_, &publishing_}) {
    if (thread->joinable()) thread->join();
  }
}

}  // namespace lbea
