#include "tools/serve/pipeline/result_publisher.hpp"

#include "runtime/src/depth/test_clock.hpp"
#include "tools/shared/answer/clock_times.hpp"

#include <cmath>

namespace lbea::tool {

constexpr std::chrono::milliseconds min_state_interval{10};  // also when states are requested more often

namespace {

std::uint64_t sum_of(const StageTimes& stages) noexcept {
  return std::uint64_t{stages.index} + stages.correspondence + stages.projection + stages.matching + stages.coverage +
         stages.fit;
}

}  // namespace

void LatencyHistogram::add(std::uint64_t ns) noexcept {
  std::size_t bucket = 0;
  while (bucket < bounds_s.size() && static_cast<double>(ns) * 1e-9 > bounds_s[bucket]) ++bucket;
  counts_[bucket].fetch_add(1, std::memory_order_relaxed);
  sum_ns_.fetch_add(ns, std::memory_order_relaxed);
}

LatencyHistogram::Counts LatencyHistogram::counts() const noexcept {
  Counts counts;
  for (std::size_t i = 0; i < counts.size(); ++i) counts[i] = counts_[i].load(std::memory_order_relaxed);
  return counts;
}

ResultPublisher::ResultPublisher(const PipelineConfig& config, std::vector<const TestEngine*> tests,
                                 wire::ResultSink sink, PipelineQueues& queues)
    : config_(config),
      tests_(std::move(tests)),
      sink_(std::move(sink)),
      queues_(queues),
      undeformed_(tests_.size()),
      departed_(tests_.size()),
      logged_clocks_ns_(config.rigs.size()),
      state_(config.description),
      channels_(tests_.size()) {}

void ResultPublisher::run() noexcept {
  publish_state();
  auto last_state = Clock::now();
  auto next_state = last_state + config_.state_interval;
  while (true) {
    ++rounds_;
    const bool is_closed = queues_.outcomes.closed();
    const bool is_busy = publish_queued();
    if (!is_busy && is_closed) break;
    if (sink_.has_newcomer()) queues_.state_requested = true;
    const auto now = Clock::now();
    if (now >= next_state || (queues_.state_requested && now >= last_state + min_state_interval)) {
      queues_.state_requested = false;
      publish_state();
      last_state = now;
      next_state = now + config_.state_interval;
    }
    if (!is_busy) queues_.publisher_bell.wait_for(std::min(max_idle, config_.state_interval));
  }
  publish_state();
}

void ResultPublisher::write_log() {
  log_.write(queues_.senders());  // first, for the names of their rigs
  log_.write();
  log_.write(counters());
}

wire::Counters ResultPublisher::counters() const noexcept {
  wire::Counters counters = queues_.counters();
  if (config_.observer == nullptr) return counters;
  const RunObserver::Counts counts = config_.observer->counts();
  counters.recorded = counts.recorded;
  counters.unrecorded = counts.unrecorded;
  return counters;
}

std::vector<wire::WireRig> ResultPublisher::rigs() const {
  std::vector<wire::WireRig> rigs = config_.description.rigs;
  for (std::size_t rig = 0; rig < rigs.size(); ++rig) rigs[rig].counters = queues_.accounts[rig].counters.load();
  return rigs;
}

bool ResultPublisher::publish_queued() noexcept {
  const Outcome* outcome = queues_.outcomes.front();
  // The rejections first: an end of stream follows all results of the frames before it.
  const bool has_published = publish_rejections();
  if (outcome == nullptr) return has_published;
  compose(*outcome, *tests_[outcome->component], result_);
  result_.model_checksum = checksum_of_frames();
  if (has_component(*outcome))
    send_of_component(*outcome);
  else
    send_of_frame();
  queues_.outcomes.release();
  return true;
}

bool ResultPublisher::publish_rejections() noexcept {
  const std::size_t queued = queues_.rejections.used();
  for (std::size_t i = 0; i < queued; ++i) {
    result_ = *queues_.rejections.front();
    result_.model_checksum = checksum_of_frames();
    send_of_frame();
    queues_.rejections.release();
  }
  return queued > 0;
}

bool ResultPublisher::has_component(const Outcome& outcome) const noexcept {
  return !config_.components.empty() && outcome.result.status != wire::WireStatus::end_of_stream;
}

std::uint64_t ResultPublisher::checksum_of_frames() const noexcept {
  return config_.components.empty() ? config_.description.model.checksum : 0;
}

/// A result that is the only one of its frame, or of no frame.
void ResultPublisher::send_of_frame() noexcept {
  send_result();
  for (std::size_t i = 0; i < tests_.size(); ++i) note_component(i);
  note_frame();
}

/// What concerns the frame is noted once, with the last component's result.
void ResultPublisher::send_of_component(const Outcome& outcome) noexcept {
  const PipelineComponent& component = config_.components[outcome.component];
  result_.component = component.name;
  result_.model_checksum = component.model_checksum;
  send_result();
  note_component(outcome.component);
  if (outcome.component == 0 || sum_of(result_.elapsed_ns.match) > sum_of(slowest_))
    slowest_ = result_.elapsed_ns.match;
  if (!outcome.of_frame) return;
  result_.status = *outcome.of_frame;
  result_.elapsed_ns.match = slowest_;
  note_frame();
}

void ResultPublisher::send_result() noexcept {
  complete_verdict(result_);
  result_.counters = counters();
  result_.sequence = sequence_++;
  result_.publish_ns = wire::wall_clock_ns();
  result_.elapsed_ns.total = short_ns(result_.publish_ns - result_.receive_ns);
  const wire::Message message = encoder_.result(result_);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->result(message, result_);
}

void ResultPublisher::note_component(std::size_t component) noexcept {
  channels_[component].add(result_);
  const std::string_view name = config_.components.empty() ? std::string_view() : config_.components[component].name;
  UndeformedCoverage& undeformed = undeformed_[component];
  if (undeformed.add(result_) && undeformed.is_low())
    log_.note_low_coverage(name, named_rig(undeformed.rig()), result_.session, result_.frame_id, *undeformed.latest());
  DepartedPoints& departed = departed_[component];
  if (departed.add(result_) && departed.are_many())
    log_.note_departed_points(name, result_.session, result_.frame_id, departed.share());
}

/// The name as the configuration, which remains, has it; empty: none.
std::string_view ResultPublisher::named_rig(std::string_view name) const noexcept {
  const auto found = std::ranges::find(config_.rigs, name, &PipelineRig::name);
  return found == config_.rigs.end() ? std::string_view() : std::string_view(found->name);
}

void ResultPublisher::note_frame() noexcept {
  if (wire::fate_of(result_.status) == wire::Fate::matched) add_times(result_.elapsed_ns);
  wire::for_each_frame(result_, [this](std::uint64_t session, std::uint64_t id, wire::WireStatus status) {
    log_.note(status, session, {id, 1});
  });
  times_.add(result_);
  const CaptureTimes::Problem problem = times_.problem();
  if (problem != std::exchange(noted_times_, problem) && problem != CaptureTimes::Problem::none)
    log_.note_wrong_times(result_.session, result_.frame_id, problem);
  note_rig_use();
  note_far_stamp();
  note_clocks();
}

/// Once per test.
void ResultPublisher::note_rig_use() noexcept {
  rig_use_.add(result_);
  const bool contradict = rig_use_.contradict();
  if (!std::exchange(is_contradiction_noted_, contradict) && contradict)
    log_.note_contradiction(result_.session, result_.frame_id);
  std::optional<RigUse::Unused> unused = rig_use_.unused();
  if (std::exchange(is_unused_noted_, unused.has_value()) || !unused) return;
  const auto rig = std::ranges::find(config_.rigs, unused->rig, &PipelineRig::name);
  if (rig == config_.rigs.end()) return;
  unused->rig = rig->name;  // remains valid
  log_.note_unused_rig(result_.session, result_.frame_id, *unused);
}

/// A change of less than a millisecond is not logged again.
void ResultPublisher::note_clocks() noexcept {
  constexpr std::int64_t noted_ns = 1'000'000;
  for (const wire::WireRigFrame& frame : result_.rigs) {
    const auto rig = std::ranges::find(config_.rigs, frame.rig, &PipelineRig::name);
    if (rig == config_.rigs.end()) continue;
    std::int64_t& logged_ns = logged_clocks_ns_[static_cast<std::size_t>(rig - config_.rigs.begin())];
    const std::int64_t behind_ns = frame.clock_correction_ns;
    if ((behind_ns == 0) == (logged_ns == 0) && std::abs(behind_ns - logged_ns) < noted_ns) continue;
    logged_ns = behind_ns;
    log_.note_clock(rig->name, result_.session, result_.frame_id, static_cast<float>(behind_ns) * 1e-6f);
  }
}

// Only the first frame of a sender: the distance hardly changes.
void ResultPublisher::note_far_stamp() noexcept {
  if (!config_.impact || !(config_.impact->duration_s > 0) || wire::fate_of(result_.status) != wire::Fate::matched)
    return;
  if (session_ == result_.session) return;
  session_ = result_.session;
  const double after_s = difference_ns(result_.stamp_ns, config_.impact->trigger_ns) * 1e-9;
  if (std::abs(after_s) > most_durations * config_.impact->duration_s)
    log_.note_far_stamp(result_.session, result_.frame_id, static_cast<float>(after_s));
}

void ResultPublisher::add_times(const wire::WireTimes& times) noexcept {
  match_times_.add(sum_of(times.match));
  total_times_.add(times.total);
}

void ResultPublisher::publish_state() noexcept {
  state_.sequence = sequence_++;
  state_.publish_ns = wire::wall_clock_ns();
  state_.queue_used = static_cast<std::uint32_t>(queues_.frames.used());
  state_.senders = queues_.senders();
  state_.rigs = rigs();
  state_.counters = counters();  // after the senders, so that an ended sender's frames are included
  if (config_.observer != nullptr) state_.recording = config_.observer->recording();
  const wire::Message message = encoder_.state(state_);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->state(message, state_);
}

}  // namespace lbea::tool
