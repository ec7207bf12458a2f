// The method, step by step, for one frame.
#include "runtime/src/match/matcher.hpp"

namespace lbea {
MatchResult Matcher::match(const Frame& frame, HistoryState* history) noexcept {
  State& s = *state_;
  s.begin_frame(frame, history);
  MatchResult result;
  result.frame_id = frame.id;
  result.stamp_ns = frame.stamp_ns;
  do {
    if (!s.index_points(frame, result)) return result;  // steps 1, 2: rigid transform, reference mesh, region
    if (s.compares_positions()) {
      s.correspond(result);  // step 3: e_i, the point nearest to vertex i
      s.project(result);     // step 5: alpha = Psi' M e
      s.search(result);      // eq. 1: min sum_i |e_i - s_i|; eq. 3: min sum_j |e_j - s_j|
    }
    s.fit(result);                // Method::fit: the depth images decide
    s.correct(result);            // fit: the estimate moves to the points
  } while (s.move_pose(result));  // again with a better pose
  s.cover(result);                // share of the estimate's or the best sample's surface that the frame shows
  s.remember(result);             // for the next frames of the test
  s.publish(result);
  s.evaluate_channels(result);  // quantities of interest
  return result;
}

void Matcher::State::begin_frame(const Frame& frame, HistoryState* of_test) noexcept {
  history = fitter && of_test && of_test->fits(view, fitter->cells()) ? of_test : nullptr;
  pose = history && history->estimates_pose && fitter->estimates_pose() ? &history->pose : nullptr;
  if (history) history->begin_frame(frame.stamp_ns);
}

bool Matcher::State::index_points(const Frame& frame, MatchResult& result) noexcept {
  result.points.received = static_cast<std::uint32_t>(frame.points.size());
  if (frame.points.size() > config.max_points) {
    result.status = Status::too_many_points;
    return false;
  }
  watch.lap_ns();
  set_reference(frame.stamp_ns, result);
  do {
    result.points = index.build(
        frame.points, pose ? product(pose->transform(), config.T_reference_sensor) : config.T_reference_sensor);
  } while (result.points.used == 0 && pose && pose->retreat());
  result.elapsed_ns.index += watch.lap_ns();
  if (result.points.used == 0) result.status = Status::empty_frame;
  return result.points.used > 0;
}

void Matcher::State::set_reference(std::int64_t stamp_ns, MatchResult& result) noexcept {
  result.reference = reference_at(view, seconds_between(config.trigger_ns, stamp_ns));
  reference = &view.references[result.reference];
}

std::uint32_t reference_at(const ModelView& model, double time) noexcept {
  const auto times = model.reference_times;
  const auto later = std::ranges::lower_bound(times, time);
  if (later == times.begin()) return 0;
  const auto earlier = later - 1;
  const bool later_is_nearer = later != times.end() && *later - time < time - *earlier;
  return static_cast<std::uint32_t>((later_is_nearer ? later : earlier) - times.begin());
}

void Matcher::State::correspond(MatchResult& result) noexcept {
  lbea::correspond(index, reference->vertex_positions, corresponding, {},
                   most_hard_tests(index, reference->vertex_positions.size()));
  result.elapsed_ns.correspondence += watch.lap_ns();
}

void Matcher::State::project(MatchResult& result) noexcept {
  lbea::project(reference->projection, corresponding, coefficients);
  result.elapsed_ns.projection += watch.lap_ns();
}

void Matcher::State::search(MatchResult& result) noexcept {
  if (config.method == Method::vtp)
    position_searches[result.reference].search(corresponding, best);
  else if (!trees.empty())
    trees[result.reference].search(coefficients, best);
  else
    search_lbea(*reference, coefficients, best);
  result.elapsed_ns.matching += watch.lap_ns();
}

void Matcher::State::fit(MatchResult& result, bool estimates_pose) noexcept {
  if (!fitter) return;
  const bool has_pose = pose && estimates_pose;
  const PoseBelief prior = has_pose ? pose->prior() : PoseBelief{};
  const FrameExpectation expectation = history ? history->expectation() : FrameExpectation{};
  result.fit = fitter->fit(
      index, best.ranked(),
      {has_pose ? &prior : nullptr, history ? &expectation : nullptr, history ? &history->hidden : nullptr});
  result.elapsed_ns.fit += watch.lap_ns();
  fitter->add_times(result.elapsed_ns);
}

void Matcher::State::correct(MatchResult& result) noexcept {
  if (!fitter) return;
  watch.lap_ns();
  fitter->correct(index, result.fit);
  const std::uint32_t taken = watch.lap_ns();
  result.elapsed_ns.fit += taken;
  result.elapsed_ns.estimate += taken;
}

bool Matcher::State::move_pose(MatchResult& result) noexcept {
  if (pose == nullptr) return false;
  watch.lap_ns();
  const std::optional<PoseMeasurement> by_points = pose_by_points();
  const double since_impact = fitter->time().mean_s - history->impact_s;
  const bool is_farther =
      pose->move(fitter->pose(), fitter->is_explained(), since_impact, by_points, fitter->hidden_residual());
  const std::uint32_t taken = watch.lap_ns();
  result.elapsed_ns.fit += taken;
  result.elapsed_ns.judgment += taken;
  pose->write(result.fit);
  return is_farther;
}

std::optional<PoseMeasurement> Matcher::State::pose_by_points() noexcept {
  if (!pose->uses_points()) return {};
  return fitter->pose_by_points(pose->calibration());
}

void Matcher::State::remember(MatchResult& result) noexcept {
  if (!history) return;
  history->see(*fitter);
  if (result.status == Status::ok && fitter->is_explained())
    history->add(shape_shown(result.stamp_ns, fitter->estimate(), fitter->error_90(), result.fit.spread),
                 fitter->time());
  history->write_time(result.stamp_ns, result.fit);
}

void Matcher::State::cover(MatchResult& result) noexcept {
  result.coverage = cover(ranked().front().sample);
  result.status = status_of(result.coverage);
  result.elapsed_ns.coverage += watch.lap_ns();
}

float Matcher::State::cover(std::uint32_t similar) noexcept {
  if (fitter) {
    surface->take(fitter->correction().surface(), fitter->correction().stride());
    surface->leave_out_unseen(fitter->images().camera, fitter->images().of_sample(similar));
  } else {
    surface->take(similar, *reference);
  }
  surface->compare(index, config.trusted_distance);
  return surface->coverage(*reference);
}

/// Those of the estimate: a combination of samples has the combination of their coefficients.
void Matcher::State::combine_coefficients(std::span<const WeightedSample> estimate) noexcept {
  const std::size_t stride = format::padded(coefficients.count);
  for (auto& plane : coefficients.planes) std::ranges::fill(plane, 0.0f);
  for (const WeightedSample& one : estimate) {
    const float* of_sample = &reference->coefficients[std::size_t{3} * stride * model.sample_index(one.sample)];
    for (auto& plane : coefficients.planes) {
      kernels().add_multiple(one.weight, of_sample, stride, plane.data());
      of_sample += stride;
    }
  }
}

void Matcher::State::publish(MatchResult& result) noexcept {
  if (!compares_positions()) combine_coefficients(result.fit.estimate);
  publish_coefficients(result);
  publish_matches(ranked(), result);
  // Low coverage alone is inconclusive; a high residual is not, unless the frame shows only a few points.
  if (fitter && (result.status == Status::ok || fitter->verdict() == Verdict::no_simulation_fits))
    result.verdict = fitter->verdict();
}

void Matcher::State::publish_coefficients(MatchResult& result) noexcept {
  for (std::size_t j = 0; j < coefficients.count; ++j)
    for (std::size_t axis = 0; axis < 3; ++axis) public_coefficients[3 * j + axis] = coefficients.planes[axis][j];
  result.coefficients = public_coefficients;
  for (std::size_t axis = 0; axis < 3; ++axis)
    result.leading_coordinates[axis] = public_coefficients[reference->leading_axes[axis]];
}

void Matcher::State::publish_matches(std::span<const RankedSample> best_first, MatchResult& result) noexcept {
  const auto nearest = best_first.first(std::min(best_first.size(), matches.size()));
  for (std::size_t k = 0; k < nearest.size(); ++k) matches[k] = {model.sample(nearest[k].sample), nearest[k].distance};
  result.matches = std::span(matches).first(nearest.size());
}

void Matcher::State::evaluate_channels(MatchResult& result) noexcept {
  if (fitter)
    result.channels = channels.of_fit(result.fit, fitter->is_hidden(), has_baked_pose && fitter->is_explained());
  else
    result.channels = channels.of_match(result.matches.front());
}

MatchResult Matcher::match(const Frame& frame) noexcept { return match(frame, nullptr); }
MatchResult Matcher::match(const Frame& frame, TestHistory& history) noexcept {
  return match(frame, history.state_.get());
}
}  // namespace lbea
