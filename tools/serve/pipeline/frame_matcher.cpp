#include "tools/serve/pipeline/frame_matcher.hpp"

namespace lbea::tool {

void FrameMatcher::run() noexcept {
  if (on_start_) on_start_();
  while (true) {
    ++rounds_;
    const bool is_closed = queues_.frames.closed();
    if (FrameSlot* slot = queues_.frames.front()) {
      match(*slot);
    } else if (is_closed) {
      break;
    } else {
      queues_.matcher_bell.wait_for(max_idle);
    }
  }
  queues_.outcomes.close();
}

void FrameMatcher::match(FrameSlot& slot) noexcept {
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  current_frame_.store(slot.header.id, std::memory_order_relaxed);
  fill(outcome, slot);
  queues_.frames.release();
  queues_.account.counters.count(outcome.result.status);
  queues_.outcomes.publish();
}

void FrameMatcher::fill(Outcome& outcome, FrameSlot& slot) noexcept {
  clear(outcome);
  wire::WireResult& result = outcome.result;
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
  result.elapsed_ns.decode = slot.decode_ns;
  result.elapsed_ns.queue = since_ns(slot.queued);
  result.status = wire::WireStatus::end_of_stream;
  if (slot.header.end_of_stream) {
    if (session_ == slot.header.session) session_.reset();
    return;
  }
  if (slot.header.session != std::exchange(session_, slot.header.session)) engine_.begin_test();
  const MatchResult match = engine_.match(
      {slot.header.id, slot.header.stamp_ns, std::span<const Point>(slot.points).first(slot.header.points)});
  fill_outcome(outcome, match, engine_.track(match));
}

}  // namespace lbea::tool
