#include "tools/serve/pipeline/capture_matcher.hpp"

namespace lbea::tool {

bool RigTests::any_runs(std::int64_t now_ns) const noexcept {
  return std::ranges::any_of(
      rigs_, [&](const Sender& sender) { return sender.is_running && now_ns - sender.receive_ns <= timeout_ns_; });
}

bool RigTests::is_running(std::uint32_t rig, std::uint64_t session) const noexcept {
  return rigs_[rig].is_running && rigs_[rig].session == session;
}

bool RigTests::begins(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) noexcept {
  Sender& sender = rigs_[rig];
  if (session != sender.session) sender.is_running = false;
  const bool is_first = !sender.is_running && !any_runs(receive_ns);
  sender = {session, receive_ns, true};
  return is_first;
}

bool RigTests::end(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) noexcept {
  Sender& sender = rigs_[rig];
  if (!sender.is_running || sender.session != session) return false;
  sender.is_running = false;
  return !any_runs(receive_ns);
}

CaptureMatcher::CaptureMatcher(const PipelineConfig& config, RigEngine& engine, PipelineQueues& queues)
    : config_(config),
      engine_(engine),
      queues_(queues),
      grouping_(config.rigs.size(), config.grouping),
      tests_(config.rigs.size(), config.sender_timeout),
      is_finished_(queues.frames.capacity()),
      threads_(config.rigs.size(), [&config](std::size_t thread) {
        if (config.on_matching_thread) config.on_matching_thread(static_cast<std::uint32_t>(thread));
      }) {}

void CaptureMatcher::run() noexcept {
  if (config_.on_matching_thread) config_.on_matching_thread(0);
  while (true) {
    const bool is_closed = queues_.frames.closed();
    const bool has_taken = take_frames();
    const bool has_matched = match_next(is_closed || is_crowded());
    finish_ends();
    if (!has_taken && !has_matched && is_closed) break;
    if (!has_taken && !has_matched) wait();
  }
}

void CaptureMatcher::wait() noexcept {
  ++rounds_;
  std::chrono::nanoseconds longest = max_idle;
  if (const auto deadline = grouping_.deadline_ns())
    longest =
        std::clamp(std::chrono::nanoseconds(*deadline - wire::wall_clock_ns()), std::chrono::nanoseconds(0), longest);
  queues_.matcher_bell.wait_for(longest);
}

/// Whether there were any.
bool CaptureMatcher::take_frames() noexcept {
  const std::uint64_t before = taken_;
  while (FrameSlot* slot = queues_.frames.at(taken_)) take(*slot);
  return taken_ != before;
}

void CaptureMatcher::take(FrameSlot& slot) noexcept {
  const wire::FrameHeader& header = slot.header;
  if (header.end_of_stream) {
    grouping_.end(slot.rig);
    ends_.push_back(taken_++);
    return;
  }
  const bool may_begin = has_ended(slot.rig) || !tests_.is_running(slot.rig, header.session);
  if (may_begin && !ends_.empty()) match_all();
  if (tests_.begins(slot.rig, header.session, slot.receive_ns)) begin_test(slot);
  const WaitingFrame frame{taken_, slot.rig, config_.common_stamp_ns(slot.rig, header.stamp_ns), slot.receive_ns};
  ++taken_;
  if (grouping_.add(frame)) return;
  publish(wire::WireStatus::out_of_step, slot);
  finish(frame.turn);
}

void CaptureMatcher::begin_test(const FrameSlot& first) noexcept {
  match_all();
  if (session_) publish_end_of_test(first.receive_ns - 1);  // a sender went without goodbye
  grouping_.begin_test();
  engine_.begin_test();
  session_ = ~first.header.session;
}

bool CaptureMatcher::match_next(bool at_once) noexcept {
  const auto capture = grouping_.next(wire::wall_clock_ns(), at_once);
  if (!capture.empty()) match(capture);
  return !capture.empty();
}

void CaptureMatcher::match(std::span<const WaitingFrame> capture) noexcept {
  current_frame_ = slot_of(capture.front()).header.id;
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  describe(outcome.result, capture);
  threads_.run(capture.size(), [&](std::size_t i) {
    const FrameSlot& slot = slot_of(capture[i]);
    engine_.match_alone(slot.rig, {slot.header.id, slot.header.stamp_ns,
                                   std::span<const Point>(slot.points).first(slot.header.points)});
  });
  fill_capture(outcome, engine_, engine_.combine(), session_.value_or(0), captures_++);
  for (std::size_t i = 0; i < capture.size(); ++i) {
    wire::WireRigFrame& frame = outcome.result.rigs[i];
    fill_rig_frame(frame, engine_.rigs()[capture[i].rig]);
    queues_.accounts[capture[i].rig].counters.count(frame.status);
  }
  queues_.outcomes.publish();
  ++rounds_;
  for (const WaitingFrame& frame : capture) finish(frame.turn);
}

/// Names and times.
void CaptureMatcher::describe(wire::WireResult& result, std::span<const WaitingFrame> capture) noexcept {
  result.receive_ns = capture.front().receive_ns;
  for (const WaitingFrame& frame : capture) {
    const FrameSlot& slot = slot_of(frame);
    result.receive_ns = std::min(result.receive_ns, slot.receive_ns);
    result.elapsed_ns.decode += slot.decode_ns;
    result.elapsed_ns.queue = std::max(result.elapsed_ns.queue, since_ns(slot.queued));
    wire::WireRigFrame& named = result.rigs.emplace_back();
    named.rig = config_.rigs[slot.rig].name;
    named.session = slot.header.session;
    named.frame_id = slot.header.id;
    named.stamp_ns = slot.header.stamp_ns;
  }
}

void CaptureMatcher::match_all() noexcept {
  while (match_next(true)) {}
  finish_ends();
}

bool CaptureMatcher::has_ended(std::uint32_t rig) noexcept {
  return std::ranges::any_of(ends_, [&](std::uint64_t turn) { return queues_.frames.at(turn)->rig == rig; });
}

/// Of streams whose frames have all been matched.
void CaptureMatcher::finish_ends() noexcept {
  std::erase_if(ends_, [this](std::uint64_t turn) {
    const FrameSlot& slot = *queues_.frames.at(turn);
    if (grouping_.has_waiting(slot.rig)) return false;
    publish(wire::WireStatus::end_of_stream, slot);
    if (tests_.end(slot.rig, slot.header.session, slot.receive_ns) && session_) {
      while (match_next(true)) {}
      publish_end_of_test(slot.receive_ns);
    }
    finish(turn);
    return true;
  });
}

void CaptureMatcher::publish_end_of_test(std::int64_t receive_ns) noexcept {
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  wire::WireResult& result = outcome.result;
  result.session = *session_;
  result.frame_id = captures_;
  result.receive_ns = receive_ns;
  result.status = wire::WireStatus::end_of_stream;
  queues_.outcomes.publish();
  session_.reset();
}

/// The result of one frame alone.
void CaptureMatcher::publish(wire::WireStatus status, const FrameSlot& slot) noexcept {
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  wire::WireResult& result = outcome.result;
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
  result.points.received = slot.header.points;
  result.status = status;
  queues_.accounts[slot.rig].counters.count(status);
  queues_.outcomes.publish();
  ++rounds_;
}

/// Slots are released in the order of their turns.
void CaptureMatcher::finish(std::uint64_t turn) noexcept {
  is_finished_[turn % is_finished_.size()] = true;
  for (; is_finished_[released_ % is_finished_.size()]; ++released_) {
    is_finished_[released_ % is_finished_.size()] = false;
    queues_.release_frame();
  }
}

}  // namespace lbea::tool
