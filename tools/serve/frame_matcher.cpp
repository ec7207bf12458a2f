#include "tools/serve/frame_matcher.hpp"

#include "tools/serve/short_ns.hpp"

#include <span>
#include <utility>

namespace lbea::tool {

void FrameMatcher::run() noexcept {
  if (at_start_) at_start_();
  while (true) {
    ++rounds_;
    const bool last_look = handover_.receiver_done;
    if (FrameSlot* slot = handover_.frames.front()) {
      match(*slot);
    } else if (last_look) {
      break;
    } else {
      handover_.frame_bell.wait_for(longest_idle);
    }
  }
  handover_.matcher_done = true;
  handover_.result_bell.ring();
}

void FrameMatcher::match(FrameSlot& slot) noexcept {
  Outcome& outcome = wait_for_slot(handover_.outcomes);
  frame_in_work_.store(slot.header.id, std::memory_order_relaxed);
  fill(outcome, slot);
  handover_.frames.release();
  handover_.counters.count(outcome.result.status);
  handover_.outcomes.publish();
  handover_.result_bell.ring();
}

void FrameMatcher::fill(Outcome& outcome, FrameSlot& slot) noexcept {
  clear(outcome);
  if (slot.header.session != std::exchange(session_, slot.header.session)) engine_.begin_test();
  wire::WireResult& result = outcome.result;
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
  result.elapsed_ns.decode = slot.decode_ns;
  result.elapsed_ns.queue = since_ns(slot.queued);
  result.status = wire::WireStatus::end_of_stream;
  if (slot.header.end_of_stream) return;
  const MatchResult match = engine_.match(
      {slot.header.id, slot.header.stamp_ns, std::span<const Point>(slot.points).first(slot.header.points)});
  fill_outcome(outcome, match, engine_.track(match));
}

}  // namespace lbea::tool
