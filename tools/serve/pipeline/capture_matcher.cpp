#include "tools/serve/pipeline/capture_matcher.hpp"

#include <utility>

namespace lbea::tool {

bool RigTests::begins(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) const noexcept {
  const Sender& sender = rigs_[rig];
  const bool is_other = sender.is_in_test && sender.session != session;
  const auto is_of_former_test = [&](const Sender& other) {
    return &other == &sender || !runs(other, receive_ns) || (is_other && other.has_restarted);
  };
  const bool is_new = !sender.is_in_test || is_other || sender.has_ended;
  return !is_open_ || (is_new && std::ranges::all_of(rigs_, is_of_former_test));
}

void RigTests::begin() noexcept {
  for (Sender& sender : rigs_) sender = {};
  is_open_ = true;
}

void RigTests::add(std::uint32_t rig, std::uint64_t session, std::int64_t receive_ns) noexcept {
  Sender& sender = rigs_[rig];
  const bool has_restarted = sender.has_restarted || (sender.is_in_test && sender.session != session);
  sender = {session, receive_ns, true, false, has_restarted};
}

void RigTests::end(std::uint32_t rig, std::uint64_t session) noexcept {
  Sender& sender = rigs_[rig];
  if (sender.is_in_test && sender.session == session) sender.has_ended = true;
}

bool RigTests::closes(std::int64_t now_ns) noexcept {
  const bool any_ended = std::ranges::any_of(rigs_, &Sender::has_ended);
  if (!is_open_ || !any_ended) return false;
  is_open_ = std::ranges::any_of(rigs_, [&](const Sender& sender) { return runs(sender, now_ns); });
  return !is_open_;
}

CaptureMatcher::CaptureMatcher(const PipelineConfig& config, RigEngine& engine, PipelineQueues& queues)
    : config_(config),
      engine_(engine),
      queues_(queues),
      grouping_(config.rigs.size(), config.grouping, config.queue_slots),
      tests_(config.rigs.size(), config.sender_timeout),
      corrections_ns_(config.rigs.size()),
      is_finished_(queues.frames.capacity()),
      threads_(config.rigs.size(), [&config](std::size_t thread) {
        if (config.on_matching_thread) config.on_matching_thread(static_cast<std::uint32_t>(thread));
      }) {
  engine_.use_threads(threads_.for_rigs());
}
CaptureMatcher::~CaptureMatcher() { engine_.use_threads({}); }

void CaptureMatcher::run() noexcept {
  if (config_.on_matching_thread) config_.on_matching_thread(0);
  while (true) {
    const bool is_closed = queues_.frames.closed();
    const bool has_taken = take_frames();
    const bool has_matched = match_next(is_closed);
    finish_ends();
    if (has_taken || has_matched) continue;
    close_test(wire::wall_clock_ns());
    if (is_closed) break;
    wait();
  }
  close_test(std::numeric_limits<std::int64_t>::max() / 2);  // no frame can follow
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
    ends_.push_back(taken_++);
    return;
  }
  if (has_end_waiting(slot.rig)) match_all();
  close_test(slot.receive_ns);
  const WaitingFrame frame{taken_, slot.rig, config_.common_stamp_ns(slot.rig, header.stamp_ns), slot.receive_ns};
  if (tests_.begins(slot.rig, header.session, slot.receive_ns) || grouping_.has_better_clock(frame)) begin_test(slot);
  ++taken_;
  grouping_.add(frame);
  bool is_refused = false;
  for (const WaitingFrame& refused : grouping_.take_refused()) {
    publish(wire::WireStatus::out_of_step, slot_of(refused));
    finish(refused.turn);
    is_refused = is_refused || refused.turn == frame.turn;
  }
  if (!is_refused) tests_.add(frame.rig, slot.header.session, frame.receive_ns);
}

void CaptureMatcher::begin_test(const FrameSlot& first) noexcept {
  match_all();
  if (tests_.is_open()) publish_end_of_test();  // a sender went without goodbye
  tests_.begin();
  grouping_.begin_test();
  engine_.begin_test();
  session_ = ~first.header.session;
  has_capture_ = false;
}

bool CaptureMatcher::match_next(bool at_once) noexcept {
  const auto capture = grouping_.next(wire::wall_clock_ns(), at_once);
  if (!capture.empty()) match(capture);
  return !capture.empty();
}

void CaptureMatcher::match(std::span<const WaitingFrame> capture) noexcept {
  current_frame_ = slot_of(capture.front()).header.id;
  if (!std::exchange(has_capture_, true)) session_ = ~slot_of(capture.front()).header.session;
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  describe(outcome.result, capture);
  threads_.run(capture.size(), [&](std::size_t i) {
    const FrameSlot& slot = slot_of(capture[i]);
    engine_.match_alone(slot.rig, {slot.header.id, slot.header.stamp_ns,
                                   std::span<const Point>(slot.points).first(slot.header.points)});
  });
  fill_capture(outcome, engine_, engine_.combine(), session_, captures_++);
  for (std::size_t i = 0; i < capture.size(); ++i) {
    wire::WireRigFrame& frame = outcome.result.rigs[i];
    fill_rig_frame(frame, engine_.rigs()[capture[i].rig]);
    queues_.accounts[capture[i].rig].counters.count(frame.status);
  }
  queues_.outcomes.publish();
  ++rounds_;
  for (const WaitingFrame& frame : capture) finish(frame.turn);
  std::ranges::transform(engine_.rigs(), corrections_ns_.begin(), &RigResult::clock_correction_ns);
  grouping_.correct_clocks(corrections_ns_);
}

/// Names and times.
void CaptureMatcher::describe(wire::WireResult& result, std::span<const WaitingFrame> capture) noexcept {
  result.receive_ns = capture.front().receive_ns;
  for (const WaitingFrame& frame : capture) {
    const FrameSlot& slot = slot_of(frame);
    if (config_.observer != nullptr) config_.observer->frame_of_test(frame.stamp_ns, slot.receive_ns);
    matched_receive_ns_ = std::max(matched_receive_ns_, slot.receive_ns);
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

bool CaptureMatcher::has_end_waiting(std::uint32_t rig) noexcept {
  return std::ranges::any_of(ends_, [&](std::uint64_t turn) { return queues_.frames.at(turn)->rig == rig; });
}

/// Of streams whose frames have all been matched.
void CaptureMatcher::finish_ends() noexcept {
  std::erase_if(ends_, [this](std::uint64_t turn) {
    const FrameSlot& slot = *queues_.frames.at(turn);
    if (grouping_.has_waiting(slot.rig)) return false;
    publish(wire::WireStatus::end_of_stream, slot);
    tests_.end(slot.rig, slot.header.session);
    grouping_.end(slot.rig);
    close_test(slot.receive_ns);
    finish(turn);
    return true;
  });
}

void CaptureMatcher::close_test(std::int64_t now_ns) noexcept {
  if (!tests_.closes(now_ns)) return;
  while (match_next(true)) {}
  publish_end_of_test();
}

/// After its captures, also by the time in its result.
void CaptureMatcher::publish_end_of_test() noexcept {
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  wire::WireResult& result = outcome.result;
  result.session = session_;
  result.frame_id = captures_;
  result.receive_ns = matched_receive_ns_ + 1;
  result.status = wire::WireStatus::end_of_stream;
  queues_.outcomes.publish();
}

/// The result of one frame alone.
void CaptureMatcher::publish(wire::WireStatus status, const FrameSlot& slot) noexcept {
  Outcome& outcome = queues_.outcomes.wait_and_claim();
  clear(outcome);
  wire::WireResult& result = outcome.result;
  name_frame(result, slot);
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
