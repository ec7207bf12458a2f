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

std::vector<wire::FrameSource> only(wire::FrameSource source) {
  std::vector<wire::FrameSource> sources;
  sources.push_back(std::move(source));
  return sources;
}

std::vector<const TestEngine*> tests_of(ComponentEngine& engine) {
  std::vector<const TestEngine*> tests;
  for (std::size_t i = 0; i < engine.components(); ++i) tests.push_back(&engine.test(i));
  return tests;
}

}  // namespace

Pipeline::Rig::Rig(wire::FrameSource frames, const PipelineConfig& config, PipelineQueues& queues, std::uint32_t number)
    : enqueuer(config, queues, number),
      receiver(std::move(frames), config.limits, config.sender_timeout, queues.accounts[number], enqueuer) {
  if (config.one_sender) receiver.allow_one_sender();
}

Pipeline::Pipeline(PipelineConfig config, std::vector<const TestEngine*> tests, std::vector<wire::FrameSource> frames,
                   wire::ResultSink results)
    : queues_(config),
      config_(described(std::move(config))),
      publisher_(config_, std::move(tests), std::move(results), queues_) {
  for (wire::FrameSource& source : frames)
    rigs_.emplace_back(std::move(source), config_, queues_, static_cast<std::uint32_t>(rigs_.size()));
}

Pipeline::Pipeline(PipelineConfig config, MatchEngine& engine, wire::FrameSource frames, wire::ResultSink results)
    : Pipeline(std::move(config), std::vector<const TestEngine*>{&engine}, only(std::move(frames)),
               std::move(results)) {
  matcher_.emplace(config_, engine, queues_);
  start();
}

Pipeline::Pipeline(PipelineConfig config, RigEngine& engine, std::vector<wire::FrameSource> frames,
                   wire::ResultSink results)
    : Pipeline(std::move(config), std::vector<const TestEngine*>{&engine}, std::move(frames), std::move(results)) {
  captures_.emplace(config_, engine, queues_);
  start();
}

Pipeline::Pipeline(PipelineConfig config, ComponentEngine& engine, wire::FrameSource frames, wire::ResultSink results)
    : Pipeline(std::move(config), tests_of(engine), only(std::move(frames)), std::move(results)) {
  components_.emplace(config_, engine, queues_);
  start();
}

/// The destructor runs when this throws: the constructor that was called first has ended.
void Pipeline::start() {
  publishing_ = std::thread(&ResultPublisher::run, &publisher_);
  if (captures_) matching_.emplace_back(&CaptureMatcher::run, &*captures_);
  if (components_) matching_.emplace_back(&ComponentMatcher::run, &*components_);
  for (std::uint32_t i = 0; matcher_ && i < config_.matchers; ++i)
    matching_.emplace_back(&FrameMatcher::run, &*matcher_, i);
  receiving_ = std::thread(&Pipeline::receive, this);
}

void Pipeline::receive() noexcept {
  if (rigs_.size() == 1) return rigs_.front().receiver.run();
  std::vector<FrameReceiver*> receivers;
  for (Rig& rig : rigs_) receivers.push_back(&rig.receiver);
  FrameReceiver::run_together(receivers);
}

wire::PeerCounts Pipeline::frame_peers() const noexcept {
  wire::PeerCounts sum;
  for (const Rig& rig : rigs_) sum += rig.receiver.peers();
  return sum;
}

std::vector<PeerLog> Pipeline::peer_logs() {
  std::vector<PeerLog> logs;
  for (std::size_t rig = 0; rig < rigs_.size(); ++rig)
    logs.emplace_back(config_.rigs.empty() ? "frames" : "frames of " + config_.rigs[rig].name, rigs_[rig].receiver);
  logs.emplace_back("results", publisher_);
  return logs;
}

Pipeline::~Pipeline() { stop(); }

/// Each thread ends after the queue before it is closed, also when the thread before it never started.
void Pipeline::stop() {
  for (Rig& rig : rigs_) rig.receiver.stop();
  if (receiving_.joinable()) receiving_.join();
  queues_.frames.close();
  for (std::thread& thread : matching_)
    if (thread.joinable()) thread.join();
  queues_.outcomes.close();
  if (publishing_.joinable()) publishing_.join();
}

}  // namespace lbea::tool
