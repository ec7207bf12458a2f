// The estimate is moved to the frame's points: shapes that are combinations of the samples are then met, where their
// depth images alone tell less.
#include "runtime/src/fit/joint_fit.hpp"
#include "tests/runtime/match/brute_force.hpp"
#include "tests/runtime/rigs/two_rigs.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// Fits frames of plates, and moves the estimates to their points or not.
class PlateFit {
 public:
  explicit PlateFit(const Model& model, bool corrects = true, float shift = FitSettings{}.correction_shift,
                    float strip = FitSettings{}.correction_strip)
      : model_(model),
        corrects_(corrects),
        fitter_(model.view(), SensorViews::baked_into(model), 1, settings_of(shift, strip)) {
    for (std::uint32_t s = 0; s < model.samples(); ++s) all_.push_back({s, 0});
  }
  SurfaceFit fit(std::span<const Point> points) {
    CloudIndex index(envelope_grid(model_.view().envelope), static_cast<std::uint32_t>(points.size()));
    index.build(points, rig_above().T_reference_sensor);
    SurfaceFit result = fitter_.fit(index, all_);
    if (corrects_) fitter_.correct(index, result);
    return result;
  }
  [[nodiscard]] const SurfaceFitter& fitter() const { return fitter_; }
  [[nodiscard]] RankedSample nearest() const { return fitter_.matches().front(); }
  /// Mean distance of the estimate's nodes from the plate that is bent by `angle`.
  double error(double angle, double hidden_from = 1e9, float nearer = 0) {
    const std::vector<float> truth = bent(angle);
    std::vector<Point> points = seen(truth, {.sigma = 0.1f});
    std::erase_if(points, [&](const Point& p) { return double{p.x} > hidden_from; });
    for (Point& p : points) p.z -= nearer;  // to the rig
    return error(points, truth);
  }
  double error(std::span<const Point> points, const std::vector<float>& truth) {
    return mean_distance(mesh_of(model_, fit(points).estimate), truth);
  }

 private:
  static FitSettings settings_of(float shift, float strip) {
    FitSettings settings;
    settings.correction_shift = shift;
    settings.correction_strip = strip;
    return settings;
  }

  const Model& model_;
  bool corrects_;
  SurfaceFitter fitter_;
  std::vector<RankedSample> all_;
};

/// Of the rig below.
struct Disturbance {
  float upwards = 0;   // shift of what it sees
  double later_s = 0;  // its frame
};

/// Fits frames of plates that one rig sees from above and one from below, without the history of a test.
class PlateFitOfTwo {
 public:
  explicit PlateFitOfTwo(const TwoRigs& rigs, float shift = FitSettings{}.correction_shift)
      : rigs_(rigs),
        views_{SensorViews::baked_into(rigs.model), rigs.rigs[1].views},
        fitters_{fitter(views_[0], shift), fitter(views_[1], shift)},
        indexes_{index(), index()},
        joint_(rigs.model.view(), *views_[0].data(), 2, 1) {
    for (std::uint32_t s = 0; s < rigs.model.samples(); ++s) all_.push_back({s, 0});
  }
  struct Errors {
    double before, after;  // the correction: mean distance from what the rig above sees
  };
  Errors errors(const std::vector<float>& above, const std::vector<float>& below, const Disturbance& disturbance = {}) {
    see(0, above);
    see(1, below, disturbance.upwards);
    evidence_ = {{{&fitters_[0], &indexes_[0], 0}, {&fitters_[1], &indexes_[1], disturbance.later_s}}};
    SurfaceFit result = joint_.fit(evidence_, nullptr);
    const double before = error(result, above);
    joint_.correct(result);
    return {before, error(result, above)};
  }
  /// By how much the frame from below is later than the one from above and what the fit has been told, s.
  double lag(const std::vector<float>& above, const std::vector<float>& below, double step_s) {
    static_cast<void>(errors(above, below));
    return joint_.lag_of(1, step_s) - joint_.lag_of(0, step_s);
  }

 private:
  [[nodiscard]] SurfaceFitter fitter(const SensorViews& views, float shift) const {
    FitSettings settings;
    settings.correction_shift = shift;
    return {rigs_.model.view(), views, 1, settings};
  }
  void see(std::size_t rig, const std::vector<float>& positions, float upwards = 0) {
    std::vector<Point> points = seen_from(rigs_.sensors[rig], positions);
    for (Point& p : points) p.z += rig == 0 ? -upwards : upwards;  // deeper for the camera below
    indexes_[rig].build(points, rigs_.sensors[rig].T_reference_sensor);
    static_cast<void>(fitters_[rig].fit(indexes_[rig], all_));
  }
  [[nodiscard]] CloudIndex index() const { return {envelope_grid(rigs_.model.view().envelope), 200'000}; }
  [[nodiscard]] double error(const SurfaceFit& fit, const std::vector<float>& truth) const {
    return mean_distance(mesh_of(rigs_.model, fit.estimate), truth);
  }

  const TwoRigs& rigs_;
  std::array<SensorViews, 2> views_;
  std::array<SurfaceFitter, 2> fitters_;
  std::array<CloudIndex, 2> indexes_;
  std::array<RigEvidence, 2> evidence_;
  JointFitter joint_;
  std::vector<RankedSample> all_;
};

/// A plate that is bent by `angle` and stretched by `strain`, without a strip along all edges.
SimulationState stretched(double angle, double strain, double strip = 0) {
  SimulationMesh mesh = plate_mesh();
  const auto inner = [strip](float& x, double length) {
    x = static_cast<float>(strip + double{x} * (1 - 2 * strip / length));
  };
  for (std::size_t i = 0; i < mesh.positions.size(); i += 3) {
    mesh.positions[i] *= static_cast<float>(1 + strain);
    inner(mesh.positions[i], 190 * (1 + strain));
    inner(mesh.positions[i + 1], 90);
  }
  return bent_state(mesh, 0, angle, 190);
}

/// Runs that bend to 0.6 and stretch by 0, 2, 4, 6 %.
AlignedBytes stretched_plates_model() {
  Ensemble ensemble;
  for (int run = 0; run < 4; ++run)
    ensemble.runs.push_back({"plate_" + std::to_string(run), {}, [run] {
                               std::vector<SimulationState> states;
                               for (int step = 0; step < 4; ++step) {
                                 states.push_back(stretched(0.2 * step, 0.02 * run * step / 3));
                                 states.back().time_s = 0.0005 * step;
                               }
                               return std::make_unique<SyntheticSimulation>(
                                   plate_mesh(), std::move(states),
                                   std::vector<SimulationField>{{"plastic_strain", "1"}});
                             }});
  const TemporaryFolder folder;
  bake_model(ensemble, bent_plates_description(), folder / "plates.lbea", with_views());
  return AlignedBytes(folder / "plates.lbea");
}

float sum_of_weights(std::span<const WeightedSample> estimate) {
  float sum = 0;
  for (const WeightedSample& one : estimate) sum += one.weight;
  return sum;
}

}  // namespace

TEST_CASE("estimates that are moved to the frame's points are nearer to shapes between the samples") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  PlateFit corrected(model), uncorrected(model, false);
  for (const double hidden_from : {1e9, 30.0}) {  // also with a third hidden
    double after = 0, before = 0;
    for (double angle = 0.3; angle < 0.97; angle += 0.02) {
      after += corrected.error(angle, hidden_from);
      before += uncorrected.error(angle, hidden_from);
    }
    CAPTURE(hidden_from);
    CAPTURE(before / 34);
    CHECK(after / 34 < 0.8 * before / 34);
  }
}

// A state of a run of the ensemble was a combination of many samples: 0.36 mm beside it on the rail, or the state
// before.
TEST_CASE("points of a sample make it the estimate, points of a shape between the samples do not") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  PlateFit corrected(model);
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    CAPTURE(s);
    const auto positions = model.node_positions(s);
    const SurfaceFit fit = corrected.fit(seen({positions.begin(), positions.end()}, {.sigma = 0.1f}, s));
    REQUIRE(fit.estimate.size() == 1);
    CHECK(fit.estimate[0].weight == 1);
    CHECK(mean_distance(mesh_of(model, fit.estimate), positions) < 1e-3);  // the first states of all runs are one shape
  }
  int between = 0;
  for (double angle = 0.3; angle < 0.97; angle += 0.02) {
    CAPTURE(angle);
    if (nearest_sample(model, bent(angle)) < 0.5) continue;
    ++between;
    CHECK(corrected.fit(seen(bent(angle), {.sigma = 0.1f})).estimate.size() > 1);
  }
  CHECK(between >= 10);
}

// A sample explained 1 to 10 distances by chance.
TEST_CASE("no more measured distances than samples make no estimate a sample") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  PlateFit corrected(model);
  for (double angle = 0.3; angle < 0.97; angle += 0.02) {
    CAPTURE(angle);
    const std::vector<Point> points = seen(bent(angle), {.sigma = 0.1f});
    std::vector<Point> few = one_per_quarter(points, corrected.fitter().images().camera);
    std::ranges::copy_if(points, std::back_inserter(few),
                         [](const Point& p) { return std::hypot(p.x, p.y) < 8; });  // some planes in the middle
    const SurfaceFit fit = corrected.fit(few);
    REQUIRE(!corrected.fitter().is_hidden());
    CHECK(fit.estimate.size() > 1);
  }
}

// A constant error of all depths was explained by a deformation.
TEST_CASE("what the pose lacks does not become a deformation") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  constexpr float no_shift = 1e-3f;
  PlateFit tolerant(model), strict(model, true, no_shift);
  double with_shift = 0, without = 0;
  for (double angle = 0.3; angle < 0.97; angle += 0.02) {
    with_shift += tolerant.error(angle, 1e9, 1);
    without += strict.error(angle, 1e9, 1);
  }
  CAPTURE(with_shift / 34);
  CAPTURE(without / 34);
  CHECK(with_shift < 0.95 * without);
}

// Image correlation gives no points within half a window of an edge. The price of the strip was that of a shift: then
// it became a deformation and, on the rail, a motion of 1.3 mm.
TEST_CASE("a strip that the points lack along all edges does not become a deformation") {
  const AlignedBytes bytes = stretched_plates_model();
  const Model model = Model::view(bytes.span());
  const FitSettings settings;
  PlateFit tolerant(model), strict(model, true, settings.correction_shift, settings.correction_shift);
  double with_strip = 0, without = 0;
  for (int i = 2; i < 12; ++i) {
    const double strain = 0.005 * i;
    const std::vector<float> truth = stretched(0.6, strain).positions;
    const std::vector<Point> points = seen(stretched(0.6, strain, 1.5).positions, {.sigma = 0.1f});
    with_strip += tolerant.error(points, truth);
    without += strict.error(points, truth);
  }
  CAPTURE(with_strip / 10);
  CAPTURE(without / 10);
  CHECK(with_strip < 0.95 * without);
}

TEST_CASE("the points of two rigs correct the estimate that both have together") {
  const TwoRigs rigs(4, 3);
  PlateFitOfTwo fit(rigs);
  double before = 0, after = 0;
  for (double angle = 0.3; angle < 0.97; angle += 0.04) {
    const auto errors = fit.errors(bent(angle), bent(angle));
    before += errors.before;
    after += errors.after;
  }
  CAPTURE(before / 17);
  CHECK(after < 0.8 * before);
}

TEST_CASE("what the pose of one rig lacks does not become a deformation in the estimate of two") {
  const TwoRigs rigs(4, 3);
  constexpr float no_shift = 1e-3f;
  PlateFitOfTwo tolerant(rigs), strict(rigs, no_shift);
  double with_shift = 0, without = 0;
  for (double angle = 0.3; angle < 0.97; angle += 0.04)
    for (const auto& [fit, sum] : {std::pair{&tolerant, &with_shift}, std::pair{&strict, &without}})
      *sum += fit->errors(bent(angle), bent(angle), {.upwards = 1}).after;
  CAPTURE(with_shift / 17);
  CAPTURE(without / 17);
  CHECK(with_shift < 0.95 * without);
}

TEST_CASE("a frame that is captured later corrects the shape of the earlier one") {
  const TwoRigs rigs(4, 3);
  PlateFitOfTwo fit(rigs);
  const double interval_s = rigs.model.view().sample_times[1] - rigs.model.view().sample_times[0];
  double known = 0, unknown = 0;
  for (double angle = 0.3; angle < 0.6; angle += 0.03) {
    constexpr double per_interval = 0.2;  // of the run in the middle
    const auto later = bent(angle + per_interval / 2);
    known += fit.errors(bent(angle), later, {.later_s = interval_s / 2}).after;
    unknown += fit.errors(bent(angle), later).after;
  }
  CAPTURE(known / 10);
  CAPTURE(unknown / 10);
  CHECK(known < 0.5 * unknown);
}

// The combination of samples is one for both frames, and in part follows the one at another time.
TEST_CASE(
    "a frame that is later than its stamp says is found to be later, an earlier one earlier, and equal ones equal") {
  const TwoRigs rigs(4, 3);
  PlateFitOfTwo fit(rigs);
  const double interval_s = rigs.model.view().sample_times[1] - rigs.model.view().sample_times[0];
  constexpr double per_interval = 0.2;  // of the run in the middle
  for (const double angle : {0.3, 0.36, 0.43}) {
    CAPTURE(angle);
    const auto lag = [&](double later) {
      return fit.lag(bent(angle), bent(angle + later * per_interval), interval_s) / interval_s;
    };
    const double equal = lag(0), earlier = lag(-0.2) - equal, later = lag(0.2) - equal;
    CAPTURE(equal);
    CAPTURE(earlier);
    CAPTURE(later);
    CHECK(std::abs(equal) < 0.1);
    CHECK(std::abs(earlier + 0.2) < 0.1);  // at least half
    CHECK(std::abs(later - 0.2) < 0.1);
  }
}

TEST_CASE("the correction keeps the sum of the weights, and the spread and time that the bake knows") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  PlateFit corrected(model), uncorrected(model, false);
  const std::vector<Point> points = seen(bent(0.77));
  const SurfaceFit after = corrected.fit(points), before = uncorrected.fit(points);
  REQUIRE(after.estimate.size() == before.estimate.size());
  CHECK(sum_of_weights(after.estimate) == doctest::Approx(1).epsilon(1e-4));
  CHECK(after.spread == before.spread);
  float changed = 0;
  for (std::size_t i = 0; i < after.estimate.size(); ++i) {
    CHECK(after.estimate[i].sample == before.estimate[i].sample);
    changed += std::abs(after.estimate[i].weight - before.estimate[i].weight);
  }
  CHECK(changed > 1e-3f);
}

TEST_CASE("a corrected frame's candidates are ranked by their distance from the estimate alone") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  PlateFit corrected(model);
  const SurfaceFit result = corrected.fit(seen(bent(0.77)));
  CHECK(*std::ranges::min_element(result.ranks) == doctest::Approx(corrected.nearest().distance));
}

TEST_CASE("too few points for a plane change no weight") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  const std::vector<Point> points = seen(bent(0.77));
  std::vector<Point> few;
  for (std::size_t i = 0; i < points.size(); i += 400) few.push_back(points[i]);
  PlateFit corrected(model), uncorrected(model, false);
  const SurfaceFit after = corrected.fit(few), before = uncorrected.fit(few);
  REQUIRE(after.estimate.size() == before.estimate.size());
  for (std::size_t i = 0; i < after.estimate.size(); ++i) CHECK(after.estimate[i].weight == before.estimate[i].weight);
}

TEST_CASE("the leaves around a point hold one of its own cell, each leaf once") {
  const auto cloud = test::random_positions(20'000, 100, 5);
  std::vector<Point> points;
  for (const auto& [x, y, z] : cloud) points.push_back({x, y, z});
  for (const std::uint32_t cells : {64u, 1'000u, 100'000u}) {
    const CellGrid grid = bounding_grid(cloud, cells);
    CloudIndex index(grid, static_cast<std::uint32_t>(points.size()));
    index.build(points, identity_transform);
    std::size_t inside = 0;
    for (std::size_t i = 0; i < cloud.size(); i += 37) {
      std::array<const Leaf*, 8> leaves;
      const std::size_t count = index.find_around(cloud[i], leaves);
      if (count == 0) continue;  // beside the first or the last cells
      ++inside;
      std::sort(leaves.begin(), leaves.begin() + count);
      CHECK(std::adjacent_find(leaves.begin(), leaves.begin() + count) == leaves.begin() + count);
      bool is_own = false;
      for (std::size_t l = 0; l < count; ++l)
        for (std::size_t lane = 0; lane < CloudIndex::fanout; ++lane)
          is_own |=
              grid.rank_of({leaves[l]->x[lane], leaves[l]->y[lane], leaves[l]->z[lane]}) == grid.rank_of(cloud[i]);
      CHECK(is_own);
    }
    CHECK(inside > 100);
  }
}
