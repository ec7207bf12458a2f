#include "tools/serve/pipeline.hpp"

#include "tools/shared/cli/wall_clock.hpp"

#include <utility>

namespace lbea::tool {
namespace {

/// With what the pipeline itself says in its description.
PipelineConfig described(PipelineConfig config) {
  config.description.start_ns = mcap::wall_clock_ns();
  config.description.max_points = config.limits.max_points;
  config.description.max_message_bytes = config.limits.max_message_bytes();
  config.description.queue_slots = config.queue_slots;
  return config;
}

}  // namespace

Pipeline::Pipeline(PipelineConfig config, MatchEngine& engine, wire::FrameSource frames, wire::ResultSink results)
    : handover_(config),
      config_(described(std::move(config))),
      receiver_(config_, std::move(frames), handover_),
      matcher_(config_, engine, handover_),
      publisher_(config_, engine, std::move(results), handover_) {
  try {
    publishing_ = std::thread(&ResultPublisher::run, &publisher_);
    matching_ = std::thread(&FrameMatcher::run, &matcher_);
    receiving_ = std::thread(&FrameReceiver::run, &receiver_);
  } catch (...) {  // no destructor runs for a half-built object
    stop();
    throw;
  }
}

Pipeline::~Pipeline() { stop(); }

/// Each thread ends once the one before it is done, which it also is when it never began.
void Pipeline::stop() {
  receiver_.stop();
  if (receiving_.joinable()) receiving_.join();
  handover_.receiver_done = true;
  handover_.frame_bell.ring();
  if (matching_.joinable()) matching_.join();
  handover_.matcher_done = true;
  handover_.result_bell.ring();
  if (publishing_.joinable()) publishing_.join();
}

}  // namespace lbea::tool
