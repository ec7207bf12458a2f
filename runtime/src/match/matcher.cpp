// The method, step by step, for one frame.
#include "runtime/src/match/matcher_state.hpp"

#include <algorithm>

namespace lbea {

MatchResult Matcher::match(const Frame& frame) noexcept {
  State& s = *state_;
  MatchResult result{.frame_id = frame.id, .stamp_ns = frame.stamp_ns};
  if (!s.index_points(frame, result)) return result;  // steps 1, 2: rigid transform, reference mesh, region
  s.correspond(result);                               // step 3: e_i, the point nearest to vertex i
  s.project(result);                                  // step 5: alpha = Psi' M e
  s.search(result);                                   // eq. 1: min sum_i |e_i - s_i|; eq. 3: min sum_j |e_j - s_j|
  s.fit(result);                                      // Method::fit: the depth images decide
  s.cover(result);                                    // share of the best sample's surface that the frame shows
  s.publish(result);
  return result;
}

bool Matcher::State::index_points(const Frame& frame, MatchResult& result) noexcept {
  result.points.received = static_cast<std::uint32_t>(frame.points.size());
  if (frame.points.size() > config.max_points) {
    result.status = Status::too_many_points;
    return false;
  }
  watch.lap_ns();
  result.reference = reference_at(view, seconds_between(config.trigger_ns, frame.stamp_ns));
  reference = &view.references[result.reference];
  result.points = index.build(frame.points, config.T_reference_sensor);
  result.elapsed_ns.index = watch.lap_ns();
  if (result.points.used == 0) result.status = Status::empty_frame;
  return result.points.used > 0;
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
  lbea::correspond(index, reference->vertex_positions, corresponding);
  result.elapsed_ns.correspondence = watch.lap_ns();
}

void Matcher::State::project(MatchResult& result) noexcept {
  lbea::project(reference->projection, corresponding, coefficients);
  result.elapsed_ns.projection = watch.lap_ns();
}

void Matcher::State::search(MatchResult& result) noexcept {
  if (config.method == Method::vtp)
    search_vtp(view, *reference, corresponding, best);
  else if (!trees.empty())
    trees[result.reference].search(coefficients, best);
  else
    search_lbea(*reference, coefficients, best);
  result.elapsed_ns.matching = watch.lap_ns();
}

void Matcher::State::fit(MatchResult& result) noexcept {
  if (fitter) result.fit = fitter->fit(index, best.ranked());
  result.elapsed_ns.fit = watch.lap_ns();
}

void Matcher::State::cover(MatchResult& result) noexcept {
  surface.take(ranked().front().sample, *reference);
  result.coverage = coverage(index, surface.positions(), surface.mass(*reference), config.trusted_distance);
  result.elapsed_ns.coverage = watch.lap_ns();
  result.status = result.coverage < config.min_coverage ? Status::low_coverage : Status::ok;
}

void Matcher::State::publish(MatchResult& result) noexcept {
  for (std::size_t j = 0; j < coefficients.count; ++j)
    for (std::size_t axis = 0; axis < 3; ++axis) public_coefficients[3 * j + axis] = coefficients.planes[axis][j];
  const auto nearest = ranked().first(std::min(ranked().size(), matches.size()));
  for (std::size_t k = 0; k < nearest.size(); ++k) matches[k] = {model.sample(nearest[k].sample), nearest[k].distance};
  result.coefficients = public_coefficients;
  result.matches = std::span(matches).first(nearest.size());
  for (std::size_t axis = 0; axis < 3; ++axis)
    result.leading_coordinates[axis] = public_coefficients[reference->leading_axes[axis]];
  // Low coverage alone is inconclusive; a high residual is not.
  if (fitter && (result.status == Status::ok || fitter->verdict() == Verdict::no_simulation_fits))
    result.verdict = fitter->verdict();
}

}  // namespace lbea
