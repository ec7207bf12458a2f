#include "tools/serve/pipeline/pipeline.hpp"

namespace lbea::tool {
namespace {

/// Completes the description with the pipeline's own settings.
PipelineConfig described(PipelineConfig config) {
  config.description.start_ns = wire::wall_clock_ns();
  config.description.max_points = config.limits.max_points;
  config.description.max_message_bytes = config.limits.max_message_bytes();
  config.description.queue_slots = config.queue_slots;
  return config;
}

}  // namespace

Pipeline::Pipeline(PipelineConfig config, MatchEngine& engine, wire::FrameSource frames, wire::ResultSink results)
    : queues_(config),
      config_(described(std::move(config))),
      enqueuer_(config_, queues_),
      receiver_(std::move(frames), config_.limits, config_.sender_timeout, queues_.account, enqueuer_),
      matcher_(config_, engine, queues_),
      publisher_(config_, engine, std::move(results), queues_) {
  if (config_.one_sender) receiver_.allow_one_sender();
  try {
    publishing_ = std::thread(&ResultPublisher::run, &publisher_);
    for (std::uint32_t i = 0; i < config_.matchers; ++i) matching_.emplace_back(&FrameMatcher::run, &matcher_, i);
    receiving_ = std::thread(&FrameReceiver::run, &receiver_);
  } catch (...) {  // the destructor does not run
    stop();
    throw;
  }
}

Pipeline::~Pipeline() { stop(); }

/// Each thread ends after the queue before it is closed, also when the thread before it never started.
void Pipeline::stop() {
  receiver_.stop();
  if (receiving_.joinable()) receiving_.join();
  queues_.frames.close();
  for (std::thread& thread : matching_)
    if (thread.joinable()) thread.join();
  queues_.outcomes.close();
  if (publishing_.joinable()) publishing_.join();
}

}  // namespace lbea::tool
