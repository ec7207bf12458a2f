#include "tools/serve/result_publisher.hpp"

#include "tools/serve/short_ns.hpp"
#include "tools/shared/cli/wall_clock.hpp"

#include <algorithm>
#include <utility>

namespace lbea::tool {
namespace {
constexpr std::chrono::milliseconds state_spacing{10};  // between states, however many ask
}

ResultPublisher::ResultPublisher(const PipelineConfig& config, const MatchEngine& engine, wire::ResultSink sink,
                                 Handover& handover)
    : config_(config), engine_(engine), sink_(std::move(sink)), handover_(handover), state_(config.description) {}

void ResultPublisher::run() noexcept {
  publish_state();
  auto last_state = Clock::now();
  auto next_state = last_state + config_.state_interval;
  while (true) {
    ++rounds_;
    const bool last_look = handover_.matcher_done;
    const bool busy = publish_waiting();
    if (!busy && last_look) break;
    if (sink_.has_newcomer()) handover_.state_wanted = true;
    const auto now = Clock::now();
    if (now >= next_state || (handover_.state_wanted && now >= last_state + state_spacing)) {
      handover_.state_wanted = false;
      publish_state();
      last_state = now;
      next_state = now + config_.state_interval;
    }
    if (!busy) handover_.result_bell.wait_for(std::min(longest_idle, config_.state_interval));
  }
  publish_state();
}

wire::Counters ResultPublisher::counters() const noexcept {
  wire::Counters counters = handover_.counters.load();
  if (config_.observer == nullptr) return counters;
  const RunObserver::Counts counts = config_.observer->counts();
  counters.recorded = counts.recorded;
  counters.unrecorded = counts.unrecorded;
  return counters;
}

bool ResultPublisher::publish_waiting() noexcept {
  const Outcome* outcome = handover_.outcomes.front();
  // An end of stream comes after everything said about the frames before it.
  const bool refused = publish_refusals();
  if (outcome == nullptr) return refused;
  publish(*outcome);
  handover_.outcomes.release();
  return true;
}

bool ResultPublisher::publish_refusals() noexcept {
  const std::size_t waiting = handover_.refusals.used();
  for (std::size_t i = 0; i < waiting; ++i) {
    publish(*handover_.refusals.front());
    handover_.refusals.release();
  }
  return waiting > 0;
}

void ResultPublisher::publish(const Outcome& outcome) noexcept {
  compose(outcome, engine_, result_);
  send_result();
}

void ResultPublisher::publish(const wire::WireResult& refusal) noexcept {
  result_ = refusal;
  send_result();
}

void ResultPublisher::send_result() noexcept {
  complete_verdict(result_);
  result_.counters = counters();
  result_.model_checksum = config_.description.model.checksum;
  result_.sequence = sequence_++;
  result_.publish_ns = mcap::wall_clock_ns();
  result_.elapsed_ns.total = short_ns(result_.publish_ns - result_.receive_ns);
  if (wire::fate_of(result_.status) == wire::Fate::matched) note_times(result_.elapsed_ns);
  const wire::Message message = encoder_.result(result_);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->result(message, result_);
  log_.note(result_);
}

void ResultPublisher::note_times(const wire::WireTimes& times) noexcept {
  const StageTimes& stages = times.match;
  match_times_.note(std::uint64_t{stages.index} + stages.correspondence + stages.projection + stages.matching +
                    stages.coverage + stages.fit);
  total_times_.note(times.total);
}

void ResultPublisher::publish_state() noexcept {
  state_.sequence = sequence_++;
  state_.publish_ns = mcap::wall_clock_ns();
  state_.queue_used = static_cast<std::uint32_t>(handover_.frames.used());
  state_.senders = handover_.senders.load();
  state_.counters = counters();  // after the senders: what became of the frames of one that has ended is in them
  if (config_.observer != nullptr) state_.recording = config_.observer->recording();
  const wire::Message message = encoder_.state(state_);
  sink_.send(message);
  if (config_.observer != nullptr) config_.observer->state(message, state_);
  log_.note(state_);
}

}  // namespace lbea::tool
