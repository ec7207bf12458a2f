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
    s.correspond(result);                               // step 3: e_i, the point nearest to vertex i
    s.project(result);                                  // step 5: alpha = Psi' M e
    s.search(result);                                   // eq. 1: min sum_i |e_i - s_i|; eq. 3: min sum_j |e_j - s_j|
    s.fit(result);                                      // Method::fit: the depth images decide
  } while (s.move_pose(result));                        // again with a better pose
  s.cover(result);                                      // share of the best sample's surface that the frame shows
  s.remember(result);                                   // for the next frames of the test
  s.publish(result);
  return result;
}

void Matcher::State::begin_frame(const Frame& frame, HistoryState* of_test) noexcept {
  history = fitter ? of_test : nullptr;
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
  result.reference = reference_at(view, seconds_between(config.trigger_ns, frame.stamp_ns));
  reference = &view.references[result.reference];
  do {
    result.points = index.build(
        frame.points, pose ? product(pose->transform(), config.T_reference_sensor) : config.T_reference_sensor);
  } while (result.points.used == 0 && pose && pose->retreat());
  result.elapsed_ns.index += watch.lap_ns();
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
    search_vtp(view, *reference, corresponding, best);
  else if (!trees.empty())
    trees[result.reference].search(coefficients, best);
  else
    search_lbea(*reference, coefficients, best);
  result.elapsed_ns.matching += watch.lap_ns();
}

void Matcher::State::fit(MatchResult& result) noexcept {
  if (!fitter) return;
  const PoseBelief prior = pose ? pose->prior() : PoseBelief{};
  const FrameExpectation expectation = history ? history->expectation() : FrameExpectation{};
  result.fit = fitter->fit(index, best.ranked(), {pose ? &prior : nullptr, history ? &expectation : nullptr});
  result.elapsed_ns.fit += watch.lap_ns();
}

bool Matcher::State::move_pose(MatchResult& result) noexcept {
  if (pose == nullptr) return false;
  const bool is_farther = pose->move(fitter->pose(), fitter->is_explained());
  pose->write(result.fit);
  return is_farther;
}

void Matcher::State::remember(MatchResult& result) noexcept {
  if (history) history->add(*fitter, result);
}

void Matcher::State::cover(MatchResult& result) noexcept {
  surface.take(ranked().front().sample, *reference);
  result.coverage = coverage(index, surface.positions(), surface.mass(*reference), config.trusted_distance);
  result.elapsed_ns.coverage += watch.lap_ns();
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
  // Low coverage alone is inconclusive; a high residual is not, unless the frame shows only a few points.
  if (fitter && (result.status == Status::ok || fitter->verdict() == Verdict::no_simulation_fits))
    result.verdict = fitter->verdict();
}

// Set-up.

namespace {
constexpr std::uint32_t most_points = 1u << 28;

void require(bool holds, const std::string& sentence) {
  if (!holds) throw Error(Status::bad_config, "matcher configuration: " + sentence);
}

// R' R = 1 and det R = 1, up to the rounding of a printed calibration file.
bool is_rigid(const RigidTransform& T) noexcept {
  constexpr double tolerance = 1e-3;
  const auto row = [&T](std::size_t i, std::size_t k) { return static_cast<double>(T[4 * i + k]); };
  if (!std::ranges::all_of(T, [](float v) { return std::isfinite(v); })) return false;
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = i; j < 3; ++j) {
      double dot = 0;
      for (std::size_t k = 0; k < 3; ++k) dot += row(i, k) * row(j, k);
      if (std::abs(dot - (i == j ? 1.0 : 0.0)) > tolerance) return false;
    }
  const double det = row(0, 0) * (row(1, 1) * row(2, 2) - row(1, 2) * row(2, 1)) -
                     row(0, 1) * (row(1, 0) * row(2, 2) - row(1, 2) * row(2, 0)) +
                     row(0, 2) * (row(1, 0) * row(2, 1) - row(1, 1) * row(2, 0));
  return det > 0;
}

void check(const MatcherConfig& config, const ModelView& model, const SensorViews& views) {
  require(config.max_points >= 1 && config.max_points <= most_points,
          "max_points is " + std::to_string(config.max_points) + "; give 1 to " + std::to_string(most_points));
  require(config.max_matches >= 1, "max_matches is 0; give at least 1");
  require(config.trusted_distance >= 0 && std::isfinite(config.trusted_distance),
          "trusted_distance is " + std::to_string(config.trusted_distance) + "; give a length, or 0 for the default");
  require(config.min_coverage >= 0 && config.min_coverage <= 1,
          "min_coverage is " + std::to_string(config.min_coverage) + "; give a share from 0 to 1");
  require(config.method == Method::lbea || config.method == Method::vtp || config.method == Method::fit,
          "unknown method; give lbea, vtp or fit");
  require(config.method != Method::fit || !views.empty(),
          "the model was baked without a sensor, so there are no depth images to compare with; bake it with one, "
          "render them for the sensor's pose, or match by lbea");
  require(views.empty() || views.data()->depths.size() == model.info.samples * padded_cells(views.data()->camera),
          "the depth images are those of another model");
  require(config.method != Method::vtp ||
              std::ranges::none_of(model.references, [](const ReferenceView& r) { return r.correspondence.empty(); }),
          "the model was baked without the samples' correspondences; bake it with them or match by lbea");
  require(is_rigid(config.T_reference_sensor),
          "T_reference_sensor is not a rigid transform; its left 3x3 part must be a rotation (no scale, no mirror)");
}
}  // namespace

MatcherConfig completed(MatcherConfig config, const Model& model) {
  constexpr double trusted_mm = 3;
  if (!(config.trusted_distance > 0))
    config.trusted_distance = static_cast<float>(trusted_mm * units_per_mm(model.length_unit()));
  return config;
}

Matcher::State::State(Model m, const MatcherConfig& c, SensorViews views)
    : model(std::move(m)),
      config(completed(c, model)),
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
    for (const ReferenceView& r : view.references) trees.emplace_back(r.coefficients, view.info.modes);
}

Matcher::Matcher(Model model, const MatcherConfig& config, SensorViews views) {
  if (views.empty()) views = SensorViews::baked_into(model);
  check(config, model.view(), views);
  state_ = std::make_unique<State>(std::move(model), config, std::move(views));
}
MatchResult Matcher::match(const Frame& frame) noexcept { return match(frame, nullptr); }
MatchResult Matcher::match(const Frame& frame, TestHistory& history) noexcept {
  return match(frame, history.state_.get());
}
Matcher::~Matcher() = default;
Matcher::Matcher(Matcher&&) noexcept = default;
Matcher& Matcher::operator=(Matcher&&) noexcept = default;
const Model& Matcher::model() const noexcept { return state_->model; }
const MatcherConfig& Matcher::config() const noexcept { return state_->config; }
}  // namespace lbea
