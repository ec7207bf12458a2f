#include "tools/serve/pipeline/frame_matcher.hpp"

namespace lbea::tool {

void FrameMatcher::run(std::uint32_t matcher) noexcept {
  if (on_start_) on_start_(matcher);
  for (Work work; take(work);) match(work, matcher);
}

bool FrameMatcher::take(Work& work) noexcept {
  const std::lock_guard lock(taking_);
  work.turn = taken_;
  while (true) {
    const bool is_closed = queues_.frames.closed();
    work.slot = queues_.frames.at(work.turn);
    if (work.slot != nullptr || is_closed) break;
    if (turns_.ended() == work.turn) ++rounds_;  // otherwise a thread that hangs would not be noticed
    queues_.matcher_bell.wait_for(max_idle);
  }
  if (work.slot == nullptr) return false;
  in_work(work.turn).id = work.slot->header.id;
  taken_ = work.turn + 1;
  work.queue_ns = since_ns(work.slot->queued);
  return true;
}

std::uint64_t FrameMatcher::current_frame() const noexcept {
  const std::uint64_t taken = taken_, ended = turns_.ended(), oldest = ended < taken || ended == 0 ? ended : ended - 1;
  return in_work_[oldest % in_work_.size()].id;
}

void FrameMatcher::match(const Work& work, std::uint32_t matcher) noexcept {
  const FrameSlot& slot = *work.slot;
  if (!engine_.matches_frames_alone()) {
    turns_.wait_for(work.turn);
    begin_test_of(slot);
  }
  Outcome& outcome = queues_.outcomes.wait_and_claim_at(work.turn);
  fill(outcome, work);
  if (!slot.header.end_of_stream)
    fill_outcome(outcome, engine_.match({slot.header.id, slot.header.stamp_ns,
                                         std::span<const Point>(slot.points).first(slot.header.points)},
                                        matcher));
  finish_matched(work.turn);
}

void FrameMatcher::finish_matched(std::uint64_t turn) noexcept {
  const std::lock_guard lock(finishing_);
  in_work(turn).is_matched = true;
  while (std::exchange(in_work(turns_.ended()).is_matched, false)) finish_oldest();
}

void FrameMatcher::finish_oldest() noexcept {
  const FrameSlot& slot = *queues_.frames.front();
  Outcome& outcome = queues_.outcomes.wait_and_claim();  // filled when it was matched
  if (engine_.matches_frames_alone()) begin_test_of(slot);
  if (!slot.header.end_of_stream) fill_test(outcome, engine_, match_of(outcome));
  queues_.accounts[slot.rig].counters.count(outcome.result.status);
  queues_.release_frame();
  queues_.outcomes.publish();
  ++rounds_;
  turns_.end_turn();
}

/// All but what the engine finds.
void FrameMatcher::fill(Outcome& outcome, const Work& work) noexcept {
  clear(outcome);
  wire::WireResult& result = outcome.result;
  name_frame(result, *work.slot);
  result.elapsed_ns.decode = work.slot->decode_ns;
  result.elapsed_ns.queue = work.queue_ns;
  result.status = wire::WireStatus::end_of_stream;
}

/// An end of stream ends the test of its session.
void FrameMatcher::begin_test_of(const FrameSlot& slot) noexcept {
  if (slot.header.end_of_stream) {
    if (session_ == slot.header.session) session_.reset();
  } else if (slot.header.session != std::exchange(session_, slot.header.session)) {
    engine_.begin_test();
  }
}

}  // namespace lbea::tool
