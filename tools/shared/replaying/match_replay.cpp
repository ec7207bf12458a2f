#include "tools/shared/replaying/match_replay.hpp"

#include <algorithm>
#include <utility>

namespace lbea::tool {

MatchReplay::MatchReplay(const Model& model, const RunSettings& settings, const SensorViews& views, unsigned threads)
    : model_(model),
      config_(settings.matcher),
      views_(views),
      decoder_(wire::WireLimits{.max_points = config_.max_points}),
      engine_(model, config_.method, views),
      slots_(threads),
      threads_(threads) {
  if (has_history(settings))
    history_.emplace(
        history_for(model, config_, views, {true, settings.estimates_pose != 0, settings.knows_impact != 0}));
  reserve(outcome_, config_.max_matches);
}

bool MatchReplay::add(const ReplayedFrame& replayed, const ResultHandler& handle) {
  const RecordedMessage& frame = replayed.message;
  Slot& slot = slots_[filled_++];
  slot.test = replayed.test;
  slot.is_wanted = replayed.is_wanted;
  slot.status = decoder_.open(encoder_.frame_of_cloud(frame.data, frame.session, frame.id));
  slot.status = status_after(ids_.observe(frame.session, frame.id).arrival, slot.status);
  slot.header = decoder_.header();
  slot.header.frame_id = {};
  slot.header.cloud = {};
  slot.receive_ns = frame.log_time_ns;
  slot.points.resize(slot.status == wire::WireStatus::ok ? slot.header.points : 0);
  if (slot.status == wire::WireStatus::ok) {
    decoder_.read_points(slot.points);
    make_room(slot);
  }
  return filled_ < slots_.size() || flush(handle);
}

bool MatchReplay::flush(const ResultHandler& handle) {
  run_batch();
  bool go_on = true;
  for (std::size_t i = 0; i < filled_ && go_on; ++i) {
    const wire::WireResult result = result_of(slots_[i]);
    if (slots_[i].is_wanted) go_on = handle(result, slots_[i].test);
  }
  filled_ = 0;
  return go_on;
}

MatcherConfig MatchReplay::with_max_points(std::uint32_t points) const {
  MatcherConfig config = config_;
  config.max_points = points;
  return config;
}

/// A recording may claim larger frames than it has, so a matcher gets memory for those that come.
void MatchReplay::make_room(Slot& slot) const {
  const auto points = static_cast<std::uint32_t>(slot.points.size());
  if (slot.matcher && points <= slot.max_points) return;
  slot.max_points = std::min(config_.max_points, points + points / 2 + 1);
  slot.matcher.reset();
  slot.matcher = std::make_unique<Matcher>(model_, with_max_points(slot.max_points), views_);
}

void MatchReplay::match(Slot& slot) {
  if (slot.status != wire::WireStatus::ok) return;
  const Frame frame{slot.header.id, slot.header.stamp_ns, slot.points};
  slot.match = history_ ? slot.matcher->match(frame, *history_) : slot.matcher->match(frame);
}

void MatchReplay::run_batch() {
  if (history_ && filled_ > 0) begin_test_of(slots_[0]);
  threads_.run(filled_, [this](std::size_t i) { match(slots_[i]); });
}

void MatchReplay::begin_test_of(const Slot& slot) {
  if (slot.status != wire::WireStatus::ok) return;  // the matcher did not get it
  if (slot.test == std::exchange(test_, slot.test)) return;
  engine_.begin_test();
  if (history_) history_->reset();
}

wire::WireResult MatchReplay::result_of(Slot& slot) {
  clear(outcome_);
  if (!history_) begin_test_of(slot);
  outcome_.result.status = slot.status;
  outcome_.result.points.received = slot.header.points;
  if (slot.status == wire::WireStatus::ok) {
    fill_outcome(outcome_, slot.match);
    fill_test(outcome_, engine_, slot.match);
  }
  wire::WireResult result;
  compose(outcome_, engine_, result);
  complete_verdict(result);
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
  result.sequence = slot.is_wanted ? sequence_++ : 0;
  result.model_checksum = model_.checksum();
  result.elapsed_ns = {};
  return result;
}

}  // namespace lbea::tool
