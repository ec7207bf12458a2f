// The pipeline: match() in the order of the method.
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/correspondence.hpp"
#include "runtime/src/match/matcher_config.hpp"
#include "runtime/src/match/nearest_samples.hpp"
#include "runtime/src/match/projection.hpp"
#include "runtime/src/match/sample_surface.hpp"
#include "runtime/src/match/stopwatch.hpp"
#include "runtime/src/match/surface_fit.hpp"
#include "runtime/src/model/model_view.hpp"
#include "runtime/src/model/sample_tree.hpp"

#include <lbea/lbea.hpp>

#include <optional>
#include <utility>
#include <vector>

namespace lbea {

struct Matcher::State {
  State(Model m, const MatcherConfig& c, SensorViews views)
      : model(std::move(m)),
        config(c),
        view(model.view()),
        index(envelope_grid(view.envelope), config.max_points),
        corresponding(view.info.vertices),
        coefficients(view.info.modes),
        public_coefficients(std::size_t{3} * view.info.modes),
        best(std::min(
            config.method == Method::fit ? std::max(config.max_matches, FitSettings{}.proposals) : config.max_matches,
            view.info.samples)),
        matches(std::min(config.max_matches, view.info.samples)),
        surface(view) {
    if (config.method == Method::fit) fitter.emplace(view, std::move(views), config.max_matches);
    if (config.method != Method::vtp && is_worth_a_tree(view.info.samples, best.capacity()))
      for (const ReferenceView& reference : view.references)
        trees.emplace_back(reference.coefficients, view.info.modes);
  }

  void search(std::uint32_t reference) noexcept;
  void fit(MatchResult& result) noexcept;
  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept {
    return fitter ? fitter->matches() : best.ranked();
  }
  float coverage_of(const RankedSample& sample, const ReferenceView& reference) noexcept;
  void publish(MatchResult& result, const ReferenceView& reference) noexcept;

  Model model;
  MatcherConfig config;
  const ModelView& view;
  CloudIndex index;
  Positions corresponding;  // e_i, eq. 1
  Positions coefficients;   // e_j, eq. 3
  std::vector<float> public_coefficients;
  BestSamples best;
  std::vector<SampleTree> trees;  // per reference, of many samples
  std::optional<SurfaceFitter> fitter;
  std::vector<Match> matches;
  SampleSurface surface;  // the best sample's
};

Matcher::Matcher(Model model, const MatcherConfig& config, SensorViews views) {
  if (views.empty()) views = SensorViews::baked_into(model);
  check(config, model.view(), views);
  state_ = std::make_unique<State>(std::move(model), config, std::move(views));
}
Matcher::~Matcher() = default;
Matcher::Matcher(Matcher&&) noexcept = default;
Matcher& Matcher::operator=(Matcher&&) noexcept = default;
const Model& Matcher::model() const noexcept { return state_->model; }
const MatcherConfig& Matcher::config() const noexcept { return state_->config; }

MatchResult Matcher::match(const Frame& frame) noexcept {
  State& s = *state_;
  MatchResult result{.frame_id = frame.id, .stamp_ns = frame.stamp_ns};
  result.points.received = static_cast<std::uint32_t>(frame.points.size());
  if (frame.points.size() > s.config.max_points) return refused(result, Status::too_many_points);
  Stopwatch watch;
  result.reference = reference_at(s.view, seconds_between(s.config.trigger_ns, frame.stamp_ns));  // step 2 (a), (b)
  const ReferenceView& reference = s.view.references[result.reference];
  result.points = s.index.build(frame.points, s.config.T_reference_sensor);  // steps 1 and 2: transform, cull
  result.elapsed_ns.index = watch.lap();
  if (result.points.used == 0) return refused(result, Status::empty_frame);
  correspond(s.index, reference.vertex_positions, s.corresponding);  // step 3: e_i
  result.elapsed_ns.correspondence = watch.lap();
  project(reference.projection, s.corresponding, s.coefficients);  // step 5: Psi' M e
  result.elapsed_ns.projection = watch.lap();
  s.search(result.reference);  // eq. 1 or eq. 3
  result.elapsed_ns.matching = watch.lap();
  s.fit(result);  // what the sensor would see decides
  result.elapsed_ns.fit = watch.lap();
  result.coverage = s.coverage_of(s.ranked().front(), reference);
  result.elapsed_ns.coverage = watch.lap();
  result.status = result.coverage < s.config.min_coverage ? Status::low_coverage : Status::ok;
  s.publish(result, reference);
  return result;
}

void Matcher::State::search(std::uint32_t reference) noexcept {
  if (config.method == Method::vtp) return search_vtp(view, view.references[reference], corresponding, best);
  if (!trees.empty()) return trees[reference].search(coefficients, best);
  search_lbea(view.references[reference], coefficients, best);
}

void Matcher::State::fit(MatchResult& result) noexcept {
  if (fitter) result.fit = fitter->fit(index, best.ranked());
}

float Matcher::State::coverage_of(const RankedSample& sample, const ReferenceView& reference) noexcept {
  surface.take(sample.sample, reference);
  return coverage(index, surface.positions(), surface.mass(reference), config.trusted_distance);
}

void Matcher::State::publish(MatchResult& result, const ReferenceView& reference) noexcept {
  for (std::size_t j = 0; j < coefficients.count; ++j)
    for (std::size_t axis = 0; axis < 3; ++axis) public_coefficients[3 * j + axis] = coefficients.planes[axis][j];
  const auto nearest = ranked().first(std::min(ranked().size(), matches.size()));
  for (std::size_t k = 0; k < nearest.size(); ++k) matches[k] = {model.sample(nearest[k].sample), nearest[k].distance};
  result.coefficients = public_coefficients;
  result.matches = std::span(matches).first(nearest.size());
  for (std::size_t axis = 0; axis < 3; ++axis)
    result.leading_coordinates[axis] = public_coefficients[reference.leading_axes[axis]];
  // Little of it in view proves nothing, but a strange surface does.
  if (fitter && (result.status == Status::ok || fitter->verdict() == Verdict::no_simulation_fits))
    result.verdict = fitter->verdict();
}

}  // namespace lbea
