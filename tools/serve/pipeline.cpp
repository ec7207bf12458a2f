#include "tools/serve/pipeline.hpp"

#include <algorithm>
#include <limits>
#include <utility>

namespace lbea {

namespace {

using namespace std::chrono_literals;

constexpr std::size_t outcome_slots = 64;
constexpr std::size_t refusal_slots = 4096;
constexpr auto longest_drain = 500ms;  // taking in after stop() what had arrived, from a sender that goes on
constexpr auto drained = 10ms;         // nothing for so long: that was all
constexpr std::size_t published_chances = 8, most_candidates = 64, most_branches = 64;
constexpr auto patience = 100us;   // between looks for a free slot; only when a queue is full
constexpr auto receive_timeout = 50ms;
constexpr auto idle = 100ms;  // a bell that was missed costs at most this

std::int64_t wall_clock_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::system_clock::now().time_since_epoch())
      .count();
}

std::uint32_t short_ns(std::int64_t ns) noexcept {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(ns, 0, std::numeric_limits<std::uint32_t>::max()));
}

std::uint32_t since_ns(std::chrono::steady_clock::time_point begin) noexcept {
  return short_ns((std::chrono::steady_clock::now() - begin) / 1ns);
}

WireStatus to_wire(Status status) noexcept {
  switch (status) {
    case Status::ok: return WireStatus::ok;
    case Status::low_coverage: return WireStatus::low_coverage;
    case Status::too_many_points: return WireStatus::too_many_points;
    default: return WireStatus::empty_frame;  // the loop has no other status
  }
}

WireVerdict verdict_of(WireStatus status) noexcept {
  if (status == WireStatus::ok) return WireVerdict::matched;
  if (status == WireStatus::low_coverage) return WireVerdict::low_coverage;
  return fate_of(status) == Fate::rejected ? WireVerdict::refused : WireVerdict::unknown;
}

WireVerdict to_wire(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::matched: return WireVerdict::matched;
    case Verdict::ambiguous: return WireVerdict::ambiguous;
    case Verdict::no_simulation_fits: return WireVerdict::no_simulation_fits;
    case Verdict::unknown: break;
  }
  return WireVerdict::unknown;
}

// The likeliest simulations, best first, in memory that is there.
void rank(std::span<const float> probabilities, std::vector<SimulationChance>& chances) noexcept {
  chances.clear();
  for (std::uint32_t i = 0; i < probabilities.size(); ++i) {
    const auto place = std::ranges::find_if(chances, [&](const SimulationChance& c) { return c.probability < probabilities[i]; });
    if (chances.size() == published_chances) {
      if (place == chances.end()) continue;
      std::copy_backward(place, chances.end() - 1, chances.end());
      *place = {i, probabilities[i]};
    } else {
      chances.insert(place, {i, probabilities[i]});
    }
  }
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
      decoder_(config_.limits) {
  for (FrameSlot& slot : frames_.slots()) slot.points.resize(config_.limits.max_points);
  for (Outcome& outcome : outcomes_.slots()) reserve(outcome);
  config_.description.start_ns = wall_clock_ns();
  config_.description.max_points = config_.limits.max_points;
  config_.description.queue_slots = config_.queue_slots;
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

void Pipeline::reserve(Outcome& outcome) const {
  outcome.matches.reserve(config_.max_matches);
  outcome.fit.candidates.reserve(most_candidates);
  outcome.fit.estimate.reserve(most_candidates);
  outcome.test.simulations.reserve(published_chances);
  outcome.test.branches.reserve(most_branches);
}

void Pipeline::receive_frames() noexcept {
  while (!stopping_) {
    if (const auto message = source_.receive(receive_timeout)) take(*message, false);
  }
  for (const auto stopped = Clock::now(); Clock::now() - stopped < longest_drain;) {
    const auto message = source_.receive(drained);
    if (!message) break;
    take(*message, true);
  }
  receiver_done_ = true;
  frame_bell_.ring();
}

void Pipeline::take(Message message, bool patient) noexcept {
  const std::int64_t receive_ns = wall_clock_ns();
  const auto begin = Clock::now();
  const WireStatus status = decoder_.open(message);
  const bool is_end = status == WireStatus::end_of_stream;
  if (!is_end) counters_.count_received();
  if (decoder_.header().identified) {
    ids_.saw(decoder_.header().session, decoder_.header().id);
    counters_.store(ids_);
  }
  if (status != WireStatus::ok && !is_end) {
    refuse(status, receive_ns);
  } else if (FrameSlot* slot = claim_slot(patient || is_end)) {
    accept(*slot, begin, receive_ns);
  } else {
    refuse(WireStatus::queue_full, receive_ns);
  }
  // After the matcher has its copy, so that it need not wait for this one.
  if (config_.observer != nullptr) config_.observer->frame(message, decoder_.header(), receive_ns);
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
  WireResult* refusal = refusals_.claim();
  if (refusal == nullptr) {
    counters_.count_unannounced();
    return;
  }
  const FrameHeader& header = decoder_.header();
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

void Pipeline::match_frames() noexcept {
  while (true) {
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
  fill(*outcome, slot);
  frames_.release();
  counters_.count(outcome->result.status);
  outcomes_.publish();
  result_bell_.ring();
}

void Pipeline::fill(Outcome& outcome, FrameSlot& slot) noexcept {
  WireResult& result = outcome.result;
  result = {};
  outcome.matches.clear();
  outcome.fit.candidates.clear();
  outcome.test.frames = 0;
  if (slot.header.session != std::exchange(matched_session_, slot.header.session)) engine_.begin_test();
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
  result.status = to_wire(match.status);
  result.reference = match.reference;
  result.coverage = match.coverage;
  result.points = match.points;
  result.elapsed_ns.match = match.elapsed_ns;
  result.leading_coordinates = match.leading_coordinates;
  result.verdict = to_wire(match.verdict);  // unknown: the status decides
  outcome.matches.assign(match.matches.begin(), match.matches.end());
  fill(outcome.fit, match.fit);
  if (const TestState* test = engine_.track(match)) fill(outcome.test, *test);
}

void Pipeline::fill(WireFit& fit, const SurfaceFit& from) noexcept {
  fit.residual = from.residual;
  fit.estimate_residual = from.estimate_residual;
  fit.misfit = from.misfit;
  fit.spread = from.spread;
  fit.candidates.assign(from.candidates.begin(), from.candidates.end());
  fit.estimate.assign(from.estimate.begin(), from.estimate.end());
}

void Pipeline::fill(WireTestState& test, const TestState& from) noexcept {
  test.frames = from.frames;
  test.simulation = from.simulation;
  test.sample = from.sample;
  test.sample_probability = from.sample_probability;
  test.misfit = from.misfit;
  test.verdict = to_wire(from.verdict);
  rank(from.simulation_probabilities, test.simulations);
  test.branches.assign(from.branch_probabilities.begin(), from.branch_probabilities.end());
}

void Pipeline::publish_results() noexcept {
  publish_state();
  auto next_state = Clock::now() + config_.state_interval;
  while (true) {
    const bool last_look = matcher_done_;
    const bool busy = publish_waiting();
    if (!busy && last_look) break;
    if (Clock::now() >= next_state) {
      publish_state();
      next_state = Clock::now() + config_.state_interval;
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
  published_ = outcome.result;
  for (const Match& match : outcome.matches)
    published_.matches.push_back({match.sample, std::string(engine_.simulation_name(match.sample.simulation)),
                                  engine_.time_s(match.sample), match.distance});
  if (!outcome.fit.candidates.empty()) published_.fit = outcome.fit;
  if (outcome.test.frames > 0) published_.test = outcome.test;
  send_published();
}

void Pipeline::publish(const WireResult& refusal) noexcept {
  published_ = refusal;
  send_published();
}

void Pipeline::send_published() noexcept {
  WireResult& result = published_;
  if (result.verdict == WireVerdict::unknown) result.verdict = verdict_of(result.status);
  result.counters = counters();
  result.model_checksum = config_.description.model.checksum;
  result.sequence = sequence_++;
  result.publish_ns = wall_clock_ns();
  result.elapsed_ns.total = short_ns(result.publish_ns - result.receive_ns);
  const Message message = encoder_.result(result);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->result(message, result);
  log_.note(result);
}

void Pipeline::publish_state() noexcept {
  WireState& state = config_.description;
  state.sequence = sequence_++;
  state.publish_ns = wall_clock_ns();
  state.queue_used = static_cast<std::uint32_t>(frames_.used());
  state.counters = counters();
  const Message message = encoder_.state(state);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->state(message, state);
}

}  // namespace lbea
