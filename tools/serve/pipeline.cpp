#include "tools/serve/pipeline.hpp"

#include "tools/common/wall_clock.hpp"

#include <algorithm>
#include <limits>
#include <tuple>
#include <utility>

namespace lbea {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t outcome_slots = 64;
constexpr std::size_t refusal_slots = 4096;
constexpr auto longest_drain = 500ms;  // taking in after stop() what had arrived, from a sender that goes on
constexpr auto drained = 100ms;        // nothing for so long: that was all. Less, and a busy machine leaves frames of a sender that has gone in the socket
constexpr auto patience = 100us;   // between looks for a free slot; only when a queue is full
constexpr auto receive_timeout = 50ms;
constexpr auto senders_interval = 100ms;  // how old what others are told of the senders may be
constexpr auto state_spacing = 10ms;      // between states, however many ask
constexpr std::uint64_t most_announced = 1000;  // of one gap; the rest is only counted
constexpr auto idle = 100ms;  // a bell that was missed costs at most this

std::uint32_t short_ns(std::int64_t ns) noexcept {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(ns, 0, std::numeric_limits<std::uint32_t>::max()));
}

std::uint32_t since_ns(std::chrono::steady_clock::time_point begin) noexcept {
  return short_ns((std::chrono::steady_clock::now() - begin) / 1ns);
}

}  // namespace

Pipeline::Pipeline(PipelineConfig config, MatchEngine& engine, FrameSource frames, ResultSink results)
    : config_(std::move(config)),
      engine_(engine),
      source_(std::move(frames)),
      sink_(std::move(results)),
      frames_(config_.queue_slots),
      outcomes_(outcome_slots),
      refusals_(refusal_slots),
      decoder_(config_.limits),
      stray_limit_(config_.stray_results_per_second) {
  for (FrameSlot& slot : frames_.slots()) slot.points.resize(config_.limits.max_points);
  for (Outcome& outcome : outcomes_.slots()) reserve(outcome, config_.max_matches);
  config_.description.start_ns = wall_clock_ns();
  config_.description.max_points = config_.limits.max_points;
  config_.description.max_message_bytes = config_.limits.max_message_bytes();
  config_.description.queue_slots = config_.queue_slots;
  state_ = config_.description;
  publisher_ = std::thread(&Pipeline::publish_results, this);
  matcher_ = std::thread(&Pipeline::match_frames, this);
  receiver_ = std::thread(&Pipeline::receive_frames, this);
}

Pipeline::~Pipeline() { stop(); }

void Pipeline::stop() {
  stopping_ = true;
  for (std::thread* thread : {&receiver_, &matcher_, &publisher_}) {
    if (thread->joinable()) thread->join();
  }
}

Counters Pipeline::counters() const noexcept {
  Counters counters = counters_.load();
  if (config_.observer == nullptr) return counters;
  const RunObserver::Counts counts = config_.observer->counts();
  counters.recorded = counts.recorded;
  counters.unrecorded = counts.unrecorded;
  return counters;
}

Pipeline::Rounds Pipeline::rounds() const noexcept {
  Rounds rounds;
  for (std::size_t i = 0; i < rounds.size(); ++i) rounds[i] = rounds_[i].load(std::memory_order_relaxed);
  return rounds;
}

void Pipeline::receive_frames() noexcept {
  while (!stopping_) {
    ++rounds_[0];
    if (const auto message = source_.receive(receive_timeout)) take(*message, false);
    if (const auto now = Clock::now(); now >= next_note_) note_senders(now);
  }
  for (const auto stopped = Clock::now(); Clock::now() - stopped < longest_drain;) {
    const auto message = source_.receive(drained);
    if (!message) break;
    take(*message, true);
  }
  note_senders(Clock::now());
  receiver_done_ = true;
  frame_bell_.ring();
}

void Pipeline::take(Message message, bool patient) noexcept {
  const std::int64_t receive_ns = wall_clock_ns();
  if (message_kind(message) == MessageKind::control && take_control(message, receive_ns)) return;
  take_frame(message, patient, receive_ns);
  // After the matcher has its copy, so that it need not wait for this one.
  if (config_.observer != nullptr) config_.observer->frame(message, decoder_.header(), receive_ns);
}

bool Pipeline::take_control(Message message, std::int64_t receive_ns) noexcept {
  Control control;
  if (decode_control(message, control) != WireStatus::ok) return false;
  const auto now = Clock::now();
  const IdTracker::Told told = ids_.told(control, now);
  counters_.store(ids_);
  announce(WireStatus::missed, control.session, told.gap, receive_ns);
  announce(WireStatus::withheld, control.session, told.withheld, receive_ns);
  if (control.kind == ControlKind::heartbeat) return true;
  note_senders(now);
  state_wanted_ = true;
  result_bell_.ring();
  return true;
}

void Pipeline::take_frame(Message message, bool patient, std::int64_t receive_ns) noexcept {
  const auto begin = Clock::now();
  WireStatus status = decoder_.open(message);
  const bool is_end = status == WireStatus::end_of_stream;
  if (!is_end) counters_.count_received();
  if (decoder_.header().identified) status = note_id(status, receive_ns);
  if (status != WireStatus::ok && !is_end) {
    refuse(status, receive_ns);
  } else if (FrameSlot* slot = claim_slot(patient || is_end)) {
    accept(*slot, begin, receive_ns);
  } else {
    refuse(WireStatus::queue_full, receive_ns);
  }
}

WireStatus Pipeline::note_id(WireStatus status, std::int64_t receive_ns) noexcept {
  const auto& [session, id] = std::tie(decoder_.header().session, decoder_.header().id);
  const auto now = Clock::now();
  if (status == WireStatus::end_of_stream) {
    const IdTracker::Told told = ids_.told({session, ControlKind::goodbye, id, 0}, now);
    counters_.store(ids_);
    announce(WireStatus::missed, session, told.gap, receive_ns);
    note_senders(now);
    return status;
  }
  const IdTracker::Seen seen = ids_.saw(session, id, now);
  counters_.store(ids_);
  announce(WireStatus::missed, session, seen.gap, receive_ns);
  const bool is_second = seen.arrival == IdTracker::Arrival::duplicate && status == WireStatus::ok;
  return is_second ? WireStatus::duplicate : status;
}

void Pipeline::note_senders(Clock::time_point now) noexcept {
  next_note_ = now + senders_interval;
  auto senders = ids_.senders(now, config_.sender_patience);
  counters_.store_silent(static_cast<std::uint64_t>(std::count_if(
      senders.begin(), senders.end(), [](const WireSender& s) { return s.condition == SenderCondition::silent; })));
  senders_.store(std::move(senders));
}

Pipeline::FrameSlot* Pipeline::claim_slot(bool patient) noexcept {
  FrameSlot* slot = frames_.claim();
  while (slot == nullptr && patient) {
    std::this_thread::sleep_for(patience);
    slot = frames_.claim();
  }
  return slot;
}

void Pipeline::accept(FrameSlot& slot, Clock::time_point begin, std::int64_t receive_ns) noexcept {
  slot.header = decoder_.header();
  slot.header.frame_id = {};
  slot.header.cloud = {};
  decoder_.read_points(slot.points);
  slot.receive_ns = receive_ns;
  slot.queued = Clock::now();
  slot.decode_ns = since_ns(begin);
  frames_.publish();
  frame_bell_.ring();
}

void Pipeline::refuse(WireStatus status, std::int64_t receive_ns) noexcept {
  counters_.count(status);
  const FrameHeader& header = decoder_.header();
  if (header.identified || stray_limit_.allows(Clock::now())) {
    announce(status, header, receive_ns);
  } else {
    counters_.count_unannounced();
  }
}

void Pipeline::announce(WireStatus status, const FrameHeader& header, std::int64_t receive_ns) noexcept {
  WireResult* refusal = refusals_.claim();
  if (refusal == nullptr) {
    counters_.count_unannounced();
    return;
  }
  *refusal = {};
  refusal->session = header.session;
  refusal->frame_id = header.id;
  refusal->stamp_ns = header.stamp_ns;
  refusal->points.received = header.points;
  refusal->status = status;
  refusal->receive_ns = receive_ns;
  refusals_.publish();
  result_bell_.ring();
}

void Pipeline::announce(WireStatus status, std::uint64_t session, IdRange ids,
                        std::int64_t receive_ns) noexcept {
  const std::uint64_t announced = std::min(ids.count, most_announced);
  FrameHeader header;
  header.session = session;
  for (header.id = ids.first; header.id - ids.first < announced; ++header.id)
    announce(status, header, receive_ns);
  if (ids.count > announced) counters_.count_unannounced(ids.count - announced);
}

void Pipeline::match_frames() noexcept {
  if (config_.on_matching_thread) config_.on_matching_thread();
  while (true) {
    ++rounds_[1];
    const bool last_look = receiver_done_;
    if (FrameSlot* slot = frames_.front()) {
      match(*slot);
    } else if (last_look) {
      break;
    } else {
      frame_bell_.wait_for(idle);
    }
  }
  matcher_done_ = true;
  result_bell_.ring();
}

void Pipeline::match(FrameSlot& slot) noexcept {
  Outcome* outcome = outcomes_.claim();
  while (outcome == nullptr) {
    std::this_thread::sleep_for(patience);
    outcome = outcomes_.claim();
  }
  frame_in_work_.store(slot.header.id, std::memory_order_relaxed);
  fill(*outcome, slot);
  frames_.release();
  counters_.count(outcome->result.status);
  outcomes_.publish();
  result_bell_.ring();
}

void Pipeline::fill(Outcome& outcome, FrameSlot& slot) noexcept {
  clear(outcome);
  if (slot.header.session != std::exchange(matched_session_, slot.header.session)) engine_.begin_test();
  WireResult& result = outcome.result;
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
  result.elapsed_ns.decode = slot.decode_ns;
  result.elapsed_ns.queue = since_ns(slot.queued);
  result.status = WireStatus::end_of_stream;
  if (slot.header.end_of_stream) return;
  const MatchResult match = engine_.match(
      {slot.header.id, slot.header.stamp_ns, std::span<const Point>(slot.points).first(slot.header.points)});
  fill_outcome(outcome, match, engine_.track(match));
}

void Pipeline::publish_results() noexcept {
  publish_state();
  auto last_state = Clock::now();
  auto next_state = last_state + config_.state_interval;
  while (true) {
    ++rounds_[2];
    const bool last_look = matcher_done_;
    const bool busy = publish_waiting();
    if (!busy && last_look) break;
    if (sink_.has_newcomer()) state_wanted_ = true;
    const auto now = Clock::now();
    if (now >= next_state || (state_wanted_ && now >= last_state + state_spacing)) {
      state_wanted_ = false;
      publish_state();
      last_state = now;
      next_state = now + config_.state_interval;
    }
    if (!busy) result_bell_.wait_for(std::min<std::chrono::nanoseconds>(idle, config_.state_interval));
  }
  publish_state();
}

bool Pipeline::publish_waiting() noexcept {
  const Outcome* outcome = outcomes_.front();
  // An end of stream comes after everything said about the frames before it.
  const bool refused = publish_refusals();
  if (outcome == nullptr) return refused;
  publish(*outcome);
  outcomes_.release();
  return true;
}

bool Pipeline::publish_refusals() noexcept {
  const std::size_t waiting = refusals_.used();
  for (std::size_t i = 0; i < waiting; ++i) {
    publish(*refusals_.front());
    refusals_.release();
  }
  return waiting > 0;
}

void Pipeline::publish(const Outcome& outcome) noexcept {
  compose(outcome, engine_, published_);
  send_published();
}

void Pipeline::publish(const WireResult& refusal) noexcept {
  published_ = refusal;
  send_published();
}

void Pipeline::send_published() noexcept {
  WireResult& result = published_;
  complete_verdict(result);
  result.counters = counters();
  result.model_checksum = config_.description.model.checksum;
  result.sequence = sequence_++;
  result.publish_ns = wall_clock_ns();
  result.elapsed_ns.total = short_ns(result.publish_ns - result.receive_ns);
  if (fate_of(result.status) == Fate::matched) {
    const StageTimes& stages = result.elapsed_ns.match;
    match_times_.note(std::uint64_t{stages.index} + stages.correspondence + stages.projection + stages.matching +
                      stages.coverage + stages.fit);
    total_times_.note(result.elapsed_ns.total);
  }
  const Message message = encoder_.result(result);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->result(message, result);
  log_.note(result);
}

void Pipeline::publish_state() noexcept {
  WireState& state = state_;
  state.sequence = sequence_++;
  state.publish_ns = wall_clock_ns();
  state.queue_used = static_cast<std::uint32_t>(frames_.used());
  state.counters = counters();
  state.senders = senders_.load();
  if (config_.observer != nullptr) state.recording = config_.observer->recording();
  const Message message = encoder_.state(state);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->state(message, state);
  log_.note(state);
}

}  // namespace lbea
