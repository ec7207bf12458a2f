#include "tools/shared/replaying/component_replay.hpp"

#include "tools/shared/replaying/match_settings.hpp"

namespace lbea::tool {

ComponentReplay::ComponentReplay(const std::vector<ComponentModel>& components, const RunSettings& settings,
                                 unsigned threads)
    : components_(components),
      engine_(components, settings.matcher,
              {has_history(settings), settings.estimates_pose != 0, settings.knows_impact != 0}),
      decoder_(wire::WireLimits{.max_points = settings.matcher.max_points}),
      results_(components.size()),
      threads_(std::min<std::size_t>(components.size(), threads)) {
  reserve(outcome_, settings.matcher.max_matches);
}

bool ComponentReplay::add(const ReplayedFrame& replayed, const ResultHandler& handle) {
  const RecordedMessage& frame = replayed.message;
  wire::WireStatus status = decoder_.open(encoder_.frame_of_cloud(frame.data, frame.session, frame.id));
  status = status_after(ids_.observe(frame.session, frame.id).arrival, status);
  if (status == wire::WireStatus::ok) return match(replayed, handle);
  clear(outcome_);
  outcome_.result.status = status;
  outcome_.result.points.received = decoder_.header().points;
  wire::WireResult result = result_of(0, replayed);
  result.component.clear();
  result.model_checksum = 0;
  return !replayed.is_wanted || handle(result, replayed.test);
}

bool ComponentReplay::match(const ReplayedFrame& replayed, const ResultHandler& handle) {
  if (replayed.test != std::exchange(test_, replayed.test)) engine_.begin_test();
  points_.resize(decoder_.header().points);
  decoder_.read_points(points_);
  const Frame frame{decoder_.header().id, decoder_.header().stamp_ns, points_};
  threads_.run(results_.size(), [&](std::size_t i) { results_[i] = engine_.match(frame, i); });
  engine_.track_all(results_);
  bool goes_on = true;
  for (std::size_t i = 0; i < results_.size(); ++i) {
    clear(outcome_);
    fill_outcome(outcome_, results_[i]);
    fill_test(outcome_, engine_.test(i), results_[i]);
    outcome_.result.points_near_none = engine_.points_near_none(frame);
    const wire::WireResult result = result_of(i, replayed);
    if (replayed.is_wanted && goes_on) goes_on = handle(result, replayed.test);
  }
  return goes_on;
}

/// Of the outcome.
wire::WireResult ComponentReplay::result_of(std::size_t component, const ReplayedFrame& replayed) {
  wire::WireResult result;
  compose(outcome_, engine_.test(component), result);
  complete_verdict(result);
  result.component = components_[component].name;
  result.session = decoder_.header().session;
  result.frame_id = decoder_.header().id;
  result.stamp_ns = decoder_.header().stamp_ns;
  result.receive_ns = replayed.message.log_time_ns;
  result.sequence = replayed.is_wanted ? sequence_++ : 0;
  result.model_checksum = components_[component].model.checksum();
  result.elapsed_ns = {};
  return result;
}

}  // namespace lbea::tool
