#include "tools/serve/pipeline/component_matcher.hpp"

namespace lbea::tool {

ComponentMatcher::ComponentMatcher(const PipelineConfig& config, ComponentEngine& engine, PipelineQueues& queues)
    : config_(config),
      engine_(engine),
      queues_(queues),
      results_(engine.components()),
      threads_(engine.components(), [&config](std::size_t thread) {
        if (config.on_matching_thread) config.on_matching_thread(static_cast<std::uint32_t>(thread));
      }) {}

void ComponentMatcher::run() noexcept {
  if (config_.on_matching_thread) config_.on_matching_thread(0);
  while (true) {
    const bool is_closed = queues_.frames.closed();
    const FrameSlot* slot = queues_.frames.front();
    if (slot == nullptr && is_closed) break;
    ++rounds_;
    if (slot == nullptr) {
      queues_.matcher_bell.wait_for(max_idle);
      continue;
    }
    queue_ns_ = since_ns(slot->queued);
    current_frame_ = slot->header.id;
    if (slot->header.end_of_stream)
      end_stream(*slot);
    else
      match(*slot);
    queues_.release_frame();
  }
}

/// The counters of all results of a frame include it.
void ComponentMatcher::match(const FrameSlot& slot) noexcept {
  begin_test_of(slot);
  const Frame frame{slot.header.id, slot.header.stamp_ns,
                    std::span<const Point>(slot.points).first(slot.header.points)};
  threads_.run(results_.size(), [&](std::size_t i) { results_[i] = engine_.match(frame, i); });
  engine_.track_all(results_);
  const wire::WireStatus of_frame = status_of_all(results_);
  const std::uint32_t points_near_none = engine_.points_near_none(frame);
  queues_.accounts[slot.rig].counters.count(of_frame);
  for (std::uint32_t i = 0; i < results_.size(); ++i) {
    Outcome& outcome = claim(slot);
    fill_outcome(outcome, results_[i]);
    fill_test(outcome, engine_.test(i), results_[i]);
    outcome.component = i;
    outcome.result.points_near_none = points_near_none;
    if (i + 1 == results_.size()) outcome.of_frame = of_frame;
    queues_.outcomes.publish();
  }
}

/// An end of stream ends the test of its session.
void ComponentMatcher::end_stream(const FrameSlot& slot) noexcept {
  if (session_ == slot.header.session) session_.reset();
  claim(slot).result.status = wire::WireStatus::end_of_stream;
  queues_.accounts[slot.rig].counters.count(wire::WireStatus::end_of_stream);
  queues_.outcomes.publish();
}

void ComponentMatcher::begin_test_of(const FrameSlot& slot) noexcept {
  if (slot.header.session != std::exchange(session_, slot.header.session)) engine_.begin_test();
}

/// All but what the engine finds.
Outcome& ComponentMatcher::claim(const FrameSlot& slot) noexcept {
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  wire::WireResult& result = outcome.result;
  name_frame(result, slot);
  result.elapsed_ns.decode = slot.decode_ns;
  result.elapsed_ns.queue = queue_ns_;
  return outcome;
}

}  // namespace lbea::tool
