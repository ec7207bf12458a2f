// Several rigs around bending plates: one looks down on them, one up, one from above at an angle.
#include "tests/runtime/rigs/two_rigs.hpp"

#include <lbea/inference.hpp>
#include <lbea/test_history.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <random>
#include <thread>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// Turned about the plate's clamped edge by 0.3 radians.
StereoSensor rig_beside() {
  StereoSensor rig = rig_above();
  const auto turned = [](const RigidTransform& T) {
    const float c = std::cos(0.3f), s = std::sin(0.3f);
    RigidTransform moved = T;
    for (std::size_t k = 0; k < 4; ++k) {
      moved[k] = c * T[k] - s * T[8 + k];
      moved[8 + k] = s * T[k] + c * T[8 + k];
    }
    return moved;
  };
  rig.T_reference_sensor = turned(rig.T_reference_sensor);
  rig.T_reference_right = turned(rig.T_reference_right);
  return rig;
}

/// A ridge along the middle: no run has it.
std::vector<float> folded() {
  std::vector<float> positions = bent(0);
  for (std::size_t i = 0; i < positions.size(); i += 3) positions[i + 2] = 40 - std::abs(positions[i] - 95) * 0.4f;
  return positions;
}

/// Of the best sample. Several runs have the same shape at different times.
double distance(const Model& model, const MatchResult& result, const std::vector<float>& positions) {
  return mean_distance(model.node_positions(model.sample_index(result.matches.front().sample)), positions);
}

/// The same, and the bakes have learned how certain poses are.
struct PosedRigs : TwoRigs {
  PosedRigs() {
    rigs[0].views = with_certain_poses(SensorViews::baked_into(model));
    rigs[1].views = with_certain_poses(rigs[1].views);
  }
  static SensorViews with_certain_poses(const SensorViews& views) {
    DepthImages images = *views.data();
    images.pose_variance = 1;
    images.pose_errors_by_points = images.pose_errors;
    return SensorViews(std::make_shared<const DepthImages>(images));
  }
};

/// By rigs that see shapes that differ a little. below: views of the second one.
std::vector<float> estimated_by(const TwoRigs& two, const SensorViews& below) {
  std::vector<Rig> rigs = two.rigs;
  rigs[1].views = below;
  RigMatcher matcher(two.model, fit_config(), rigs);
  matcher.fix_poses();
  const auto from_above = seen_from(two.sensors[0], bent(0.63)), from_below = seen_from(two.sensors[1], bent(0.6), 2);
  const MatchResult result = matcher.match(std::vector<Frame>{at(1, from_above), at(1, from_below)});
  for (const RigResult& rig : matcher.rigs()) REQUIRE(rig.is_used);
  Inferred inferred;
  infer_positions(two.model, result.fit, inferred);
  return {inferred.mean.begin(), inferred.mean.end()};
}

}  // namespace

TEST_CASE("two rigs that see both sides name the sample that they see, and rest on both") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  for (std::uint32_t sample = 1; sample < two.model.samples(); sample += 5) {
    CAPTURE(sample);
    matcher.reset();
    const std::vector<float> positions = positions_of(two.model, sample);
    const auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
    const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, below)});
    REQUIRE(result.status == Status::ok);
    CHECK(result.verdict != Verdict::no_simulation_fits);
    CHECK(distance(two.model, result, positions) < 1e-3);
    CHECK(result.points.received == above.size() + below.size());
    for (const RigResult& rig : matcher.rigs()) {
      CHECK(rig.is_used);
      CHECK(rig.status == Status::ok);
      CHECK(rig.coverage > 0.9f);
    }
  }
}

TEST_CASE("shares of the joint estimate add up to 1, and its lists have the promised sizes") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  const std::vector<float> positions = bent(0.63);  // between two runs
  const auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
  const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, below)});
  float shares = 0;
  for (const WeightedSample& one : result.fit.estimate) shares += one.weight;
  CHECK(shares == doctest::Approx(1).epsilon(1e-4));
  CHECK(result.fit.candidates.size() == result.fit.ranks.size());
  CHECK(result.matches.size() == fit_config().max_matches);
  CHECK(result.coefficients.size() == std::size_t{3} * two.model.modes());
  Inferred inferred;
  infer_positions(two.model, result.fit, inferred);
  CHECK(mean_distance(inferred.mean, positions) < 1);  // the states of two runs are 3 to 5 mm apart
}

// In a sparse ensemble the estimate is close to the prediction. Without the bounds, a rig that shows little of the
// shape counted as much as one that shows it well: two rigs were worse than the better one alone.
TEST_CASE("a rig's prediction counts by the bound of its own estimate") {
  const TwoRigs two;
  const SensorViews& below = two.rigs[1].views;
  const float learned = below.data()->error_per_spread;
  REQUIRE(learned > 0);
  const auto good = estimated_by(two, below);
  const auto bad = estimated_by(two, changed(below, [&](DepthImages& images) { images.error_per_spread *= 1e4f; }));
  const auto none =
      estimated_by(two, changed(below, [](DepthImages& images) { images.regression.most_difference = 0; }));
  REQUIRE(mean_distance(good, none) > 0.01);
  CHECK(mean_distance(bad, none) < 1e-3 * mean_distance(good, none));
}

// With 48 candidates of ten runs, many of which were of another deformation branch, two rigs had 1.9 times the best
// sample's error where one had 0.9.
TEST_CASE("in a sparse ensemble a joint estimate combines three states per run, as many as for one rig or more") {
  for (const auto& most_for : {std::pair{6u, 24u}, {12u, 36u}, {20u, 48u}}) {
    CAPTURE(most_for.first);
    const TwoRigs two(8, most_for.first);
    RigMatcher matcher = two.matcher();
    const auto above = seen_from(two.sensors[0], bent(0.63)), below = seen_from(two.sensors[1], bent(0.63), 2);
    const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, below)});
    CHECK(result.fit.candidates.size() == most_for.second);
  }
}

TEST_CASE("without a frame of one rig, the result rests on the others") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  const std::vector<float> positions = positions_of(two.model, 12);
  const auto below = seen_from(two.sensors[1], positions, 2);
  const MatchResult result = matcher.match(std::vector<Frame>{{}, at(3, below)});
  REQUIRE(result.status == Status::ok);
  CHECK(two.model.sample_index(result.matches.front().sample) == 12);
  CHECK(result.frame_id == 3);
  CHECK(result.stamp_ns == 3'000'000);
  CHECK_FALSE(matcher.rigs()[0].is_used);
  CHECK(matcher.rigs()[0].status == Status::empty_frame);
  CHECK(matcher.rigs()[1].is_used);
  const MatchResult nothing = matcher.match(std::vector<Frame>{{}, {}});
  CHECK(nothing.status == Status::empty_frame);
  CHECK(nothing.matches.empty());
  CHECK_FALSE(matcher.rigs()[1].is_used);
  CHECK(matcher.match({}).status == Status::empty_frame);  // fewer frames than rigs
}

TEST_CASE("a rig that shows another component does not count, and the verdict is unknown") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  const std::vector<float> other_shape = folded();
  for (std::uint32_t sample : {12u, 30u, 44u}) {
    CAPTURE(sample);
    const std::vector<float> positions = positions_of(two.model, sample);
    const auto above = seen_from(two.sensors[0], positions), other = seen_from(two.sensors[1], other_shape, 2);
    const MatchResult result = matcher.match(std::vector<Frame>{at(sample, above), at(sample, other)});
    CHECK(distance(two.model, result, positions) < 1e-3);
    CHECK(result.verdict == Verdict::unknown);
    CHECK(std::isnan(result.fit.error_90));
    CHECK(matcher.rigs()[0].is_used);
    CHECK_FALSE(matcher.rigs()[1].is_used);
    CHECK(matcher.rigs()[1].verdict == Verdict::no_simulation_fits);
    matcher.reset();
  }
  const auto above = seen_from(two.sensors[0], other_shape), below = seen_from(two.sensors[1], other_shape, 2);
  CHECK(matcher.match(std::vector<Frame>{at(1, above), at(1, below)}).verdict == Verdict::no_simulation_fits);
}

// One stray point of a rig whose clock is ahead turned all other rigs off.
// Regression: frames of two tests gave the verdict `matched`.
TEST_CASE("rigs that see different shapes, each of which a simulation explains, give no verdict") {
  const TwoRigs two;
  const auto matched = [&](double above_angle, double below_angle) {
    RigMatcher matcher = two.matcher();
    const auto above = seen_from(two.sensors[0], bent(above_angle)),
               below = seen_from(two.sensors[1], bent(below_angle), 2);
    const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, below)});
    for (const RigResult& rig : matcher.rigs()) {
      CHECK(rig.verdict != Verdict::no_simulation_fits);
      CHECK(rig.is_used);
    }
    return result;
  };
  CHECK(matched(0.6, 0.6).verdict != Verdict::unknown);
  for (const double other : {0.2, 0.4}) {
    CAPTURE(other);
    const MatchResult different = matched(0.6, other);
    CHECK((different.verdict == Verdict::unknown || different.verdict == Verdict::no_simulation_fits));
    CHECK(std::isnan(different.fit.error_90));
  }
}

TEST_CASE("a frame that no simulation explains, with a later stamp, leaves the others in use") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  const std::vector<float> positions = positions_of(two.model, 12);
  const auto above = seen_from(two.sensors[0], positions), other = seen_from(two.sensors[1], folded(), 2);
  const std::vector<Point> stray{other.front()};
  for (const std::span<const Point> ahead : {std::span<const Point>(other), std::span<const Point>(stray)}) {
    matcher.reset();
    const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1001, ahead)});
    CHECK(matcher.rigs()[0].is_used);
    CHECK(distance(two.model, result, positions) < 1e-3);
  }
}

// One stray point had the verdict "no simulation fits".
TEST_CASE("a few points are no evidence and bound no error") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  const auto above = seen_from(two.sensors[0], positions_of(two.model, 12));
  for (const std::size_t points : {1u, 5u, 30u}) {
    CAPTURE(points);
    matcher.reset();
    const MatchResult result = matcher.match(std::vector<Frame>{at(1, std::span(above).first(points)), {}});
    CHECK(result.verdict == Verdict::unknown);
    CHECK(std::isnan(result.fit.error_90));
  }
}

// The second rig sees the next state; without the stamps, the shape would be one between the two.
TEST_CASE("frames at different times are evidence for one time") {
  const TwoRigs two(16);
  RigMatcher matcher = two.matcher();
  for (const std::uint32_t sample : {24u, 57u, 90u}) {
    CAPTURE(sample);
    const std::vector<float> earlier = positions_of(two.model, sample), later = positions_of(two.model, sample + 1);
    const auto above = seen_from(two.sensors[0], earlier), below = seen_from(two.sensors[1], later, 2);
    const Frame first = at(1, above);
    Frame second = at(1, below);
    const auto error = [&] {
      matcher.reset();
      const MatchResult result = matcher.match(std::vector<Frame>{first, second});
      CHECK(matcher.rigs()[0].is_used);
      CHECK(matcher.rigs()[1].is_used);
      Inferred inferred;
      infer_positions(two.model, result.fit, inferred);
      return mean_distance(inferred.mean, earlier);
    };
    const double at_one_time = error();
    second.stamp_ns += std::llround(1e9 * (two.model.sample_time_s(sample + 1) - two.model.sample_time_s(sample)));
    CHECK(error() < at_one_time / 2);
  }
}

TEST_CASE("a frame of another time than the latest one does not count") {
  const TwoRigs two;
  RigMatcher matcher = two.matcher();
  const std::vector<float> positions = positions_of(two.model, 20);
  const auto above = seen_from(two.sensors[0], bent(0)), below = seen_from(two.sensors[1], positions, 2);
  const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(201, below)});
  CHECK(distance(two.model, result, positions) < 1e-3);
  CHECK_FALSE(matcher.rigs()[0].is_used);
  CHECK(matcher.rigs()[0].verdict == Verdict::matched);
}

TEST_CASE("an offset of a rig's clock is taken from its stamps") {
  TwoRigs two;
  two.rigs[1].clock_offset_ns = -5'000'000'000;
  RigMatcher matcher = two.matcher();
  const std::vector<float> positions = positions_of(two.model, 12);
  const auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
  (void)matcher.match(std::vector<Frame>{at(1, above), at(5001, below)});
  CHECK(matcher.rigs()[0].is_used);
  CHECK(matcher.rigs()[1].is_used);
  (void)matcher.match(std::vector<Frame>{at(2, above), at(2, below)});  // five seconds older than the first one
  CHECK(matcher.rigs()[0].is_used);
  CHECK_FALSE(matcher.rigs()[1].is_used);
  Frame extreme = at(3, below);
  extreme.stamp_ns = std::numeric_limits<std::int64_t>::min();
  const MatchResult result = matcher.match(std::vector<Frame>{extreme, at(3, below)});
  CHECK_FALSE(matcher.rigs()[0].is_used);  // the second one's clock is five seconds behind, but later than that
  CHECK(result.stamp_ns == 3'000'000 - 5'000'000'000);
  extreme.points = below;
  CHECK(matcher.match(std::vector<Frame>{{}, extreme}).stamp_ns > 0);  // wraps around
}

TEST_CASE("in two steps, by two threads, a capture gives the same as in one") {
  const TwoRigs two;
  RigMatcher one_step = two.matcher(), two_steps = two.matcher();
  for (std::uint32_t sample = 8; sample < 16; ++sample) {
    const std::vector<float> positions = positions_of(two.model, sample);
    const auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
    const MatchResult expected = one_step.match(std::vector<Frame>{at(sample, above), at(sample, below)});
    two_steps.match_alone(0, at(sample, below));  // replaced by the next one
    std::thread second([&] { two_steps.match_alone(1, at(sample, below)); });
    two_steps.match_alone(0, at(sample, above));
    second.join();
    two_steps.match_alone(2, at(sample, above));  // no such rig
    const MatchResult result = two_steps.combine();
    CHECK(result.fit.residual == expected.fit.residual);
    CHECK(std::ranges::equal(result.coefficients, expected.coefficients));
  }
}

// One rig is hidden in part or sees the plate later, and poses are estimated: each step that is divided has work to do.
TEST_CASE("combine() gives the same bits on threads, and all of them have a part") {
  const PosedRigs two;
  RigMatcher alone(two.model, fit_config(), two.rigs), divided(two.model, fit_config(), two.rigs);
  std::array<std::atomic<int>, 2> parts{};
  RigThreads threads;
  threads.threads = &parts;
  threads.run = [](void* counts, std::size_t count, void (*part)(const void*, std::size_t), const void* work) {
    std::vector<std::thread> started;
    for (std::size_t i = 0; i < count; ++i)
      started.emplace_back([=] {
        ++(*static_cast<std::array<std::atomic<int>, 2>*>(counts))[i];
        part(work, i);
      });
    for (std::thread& thread : started) thread.join();
  };
  divided.use_threads(threads);
  const auto same = [](std::span<const float> a, std::span<const float> b) {
    return std::ranges::equal(a, b, {}, std::bit_cast<std::uint32_t, float>, std::bit_cast<std::uint32_t, float>);
  };
  for (std::uint32_t sample = 8; sample < 16; ++sample) {
    CAPTURE(sample);
    const std::vector<float> positions = positions_of(two.model, sample);
    auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
    for (Point& p : above) p.x += sample < 11 ? 3.0f : 0.0f;
    if (sample == 10 || sample == 13) std::erase_if(below, [](const Point& p) { return p.x > 0 && p.y > 0; });
    const std::vector<Frame> frames{at(sample, above), at(sample + (sample % 3 == 0 ? 0.2 : 0), below)};
    const MatchResult expected = alone.match(frames), result = divided.match(frames);
    CHECK(same(result.coefficients, expected.coefficients));
    CHECK(same(
        std::array{result.fit.residual, result.fit.estimate_residual, result.fit.spread, result.fit.misfit},
        std::array{expected.fit.residual, expected.fit.estimate_residual, expected.fit.spread, expected.fit.misfit}));
    REQUIRE(result.fit.estimate.size() == expected.fit.estimate.size());
    for (std::size_t i = 0; i < result.fit.estimate.size(); ++i)
      CHECK(same(std::array{result.fit.estimate[i].weight}, std::array{expected.fit.estimate[i].weight}));
    for (const std::size_t rig : {0u, 1u}) CHECK(divided.pose_correction(rig) == alone.pose_correction(rig));
  }
  CHECK(divided.pose_correction(0) != identity_transform);
  for (const std::atomic<int>& of_thread : parts) CHECK(of_thread > 8);
}

TEST_CASE("each rig's pose error is found and corrected; one frame is one measurement") {
  PosedRigs two;
  RigMatcher matcher(two.model, fit_config(), two.rigs);
  const std::vector<float> positions = positions_of(two.model, 3);
  const auto above = seen_from(two.sensors[0], positions);
  auto below = seen_from(two.sensors[1], positions, 2);
  for (Point& p : below) p = {p.x + 3, p.y - 3, p.z + 2};  // along the axes of the reference
  MatchResult result;
  for (int frame = 0; frame < 6; ++frame)
    result = matcher.match(std::vector<Frame>{at(0.1 * frame, above), at(0.1 * frame, below)});
  CHECK(distance(two.model, result, positions) < 1e-3);
  CHECK(matcher.rigs()[0].pose_shift < 0.5f);
  CHECK(std::abs(matcher.rigs()[1].pose_shift - std::sqrt(22.0f)) < 0.5f);
  const RigidTransform correction = matcher.pose_correction(1);
  CHECK(std::abs(correction[11] + 2) < 0.5f);  // depth is known best

  RigMatcher once(two.model, fit_config(), two.rigs), twice(two.model, fit_config(), two.rigs);
  once.match_alone(0, at(0, above));
  for (int i = 0; i < 2; ++i) twice.match_alone(0, at(0, above));
  (void)once.combine();
  (void)twice.combine();
  CHECK(twice.rigs()[0].pose_shift == once.rigs()[0].pose_shift);
  CHECK(twice.rigs()[0].pose_shift_sd == once.rigs()[0].pose_shift_sd);
}

TEST_CASE("where a rig's images say nothing about its pose, its points do") {
  PosedRigs two;
  const std::vector<float> positions = positions_of(two.model, 3);
  const auto above = seen_from(two.sensors[0], positions);
  auto below = seen_from(two.sensors[1], positions, 2);
  for (Point& p : below) p.z += 2;
  for (const bool by_points : {false, true}) {
    for (Rig& rig : two.rigs)
      rig.views = changed(rig.views, [by_points](DepthImages& images) {
        for (PoseMatrix& spread : images.pose_errors.spreads.at_times)
          for (double& entry : spread) entry *= 1e8;
        images.pose_errors_by_points = by_points ? std::optional(PoseErrors()) : std::nullopt;
      });
    RigMatcher matcher(two.model, fit_config(), two.rigs);
    for (int frame = 0; frame < 6; ++frame)
      (void)matcher.match(std::vector<Frame>{at(0.1 * frame, above), at(0.1 * frame, below)});
    CAPTURE(by_points);
    CHECK(std::abs(matcher.pose_correction(1)[11] + (by_points ? 2 : 0)) < 0.2f);
    CHECK(std::abs(matcher.pose_correction(0)[11]) < 0.2f);
  }
}

// The first rig's equations held the sums of all rigs: its pose was not a number, and what its images tell was ignored.
TEST_CASE("a first rig with too few points for a plane has the pose that its images tell") {
  PosedRigs two;
  const std::vector<float> positions = positions_of(two.model, 3);
  auto above = seen_from(two.sensors[0], positions);
  for (Point& p : above) p.z += 2;
  std::mt19937 random(1);
  std::erase_if(above, [&](const Point&) { return random() % 20 != 0; });
  const auto below = seen_from(two.sensors[1], positions, 2);
  RigMatcher matcher(two.model, fit_config(), two.rigs);
  for (int frame = 0; frame < 6; ++frame)
    (void)matcher.match(std::vector<Frame>{at(0.1 * frame, above), at(0.1 * frame, below)});
  REQUIRE(matcher.rigs()[0].is_used);
  CHECK(std::abs(matcher.pose_correction(0)[11] - 2) < 0.5f);  // nearer to the rig above
}

// The frames before reset() entered the next test, with their pose.
TEST_CASE("a reset between the two steps forgets the frames and the poses") {
  PosedRigs two;
  RigMatcher matcher(two.model, fit_config(), two.rigs);
  const std::vector<float> positions = positions_of(two.model, 3);
  auto above = seen_from(two.sensors[0], positions);
  for (Point& p : above) p.x += 4;
  (void)matcher.match(std::vector<Frame>{at(1, above), {}});
  REQUIRE(matcher.pose_correction(0) != identity_transform);
  matcher.match_alone(0, at(2, above));
  matcher.reset();
  const MatchResult result = matcher.combine();
  CHECK(result.status == Status::empty_frame);
  CHECK(result.frame_id == 0);
  CHECK(result.stamp_ns == 0);
  CHECK(matcher.pose_correction(0) == identity_transform);
  CHECK(RigMatcher(two.model, fit_config(), two.rigs).combine().status == Status::empty_frame);  // without any frame
}

// What hides most of one rig's view must not move the estimate: the other rig shows it.
TEST_CASE("a part hidden from one rig is taken from the other") {
  TwoRigs two;
  two.sensors[1] = rig_beside();
  two.rigs[1] = {two.sensors[1].T_reference_sensor, views_from(two.sensors[1], two.model)};
  RigMatcher matcher = two.matcher();
  for (const std::uint32_t sample : {15u, 31u, 47u}) {  // the last states
    CAPTURE(sample);
    matcher.reset();
    const std::vector<float> positions = positions_of(two.model, sample);
    auto above = seen_from(two.sensors[0], positions);
    const auto beside = seen_from(two.sensors[1], positions, 2);
    const auto free_end = [](const Point& p) { return p.x > -40; };  // in the sensor's coordinates
    above.erase(std::remove_if(above.begin(), above.end(), free_end), above.end());
    REQUIRE(above.size() > 1000);
    const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, beside)});
    CHECK(distance(two.model, result, positions) < 1e-3);
  }
}

TEST_CASE("the views of another rig may come from a model that was baked for it") {
  const TwoRigs two;
  const TemporaryFolder folder;
  BakeOptions options;
  options.depth_renderer = [](const CommonMesh& mesh, const std::array<float, 3>& low,
                              const std::array<float, 3>& high) {
    return make_depth_renderer(rig_below(), mesh.node_ids.size(), mesh.elements, low, high);
  };
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "below.lbea", options);
  const SensorViews below_views = SensorViews::baked_into(Model::open(folder / "below.lbea"));
  RigMatcher matcher(two.model, fit_config(), {two.rigs[0], {two.sensors[1].T_reference_sensor, below_views}});
  matcher.fix_poses();
  const std::vector<float> positions = positions_of(two.model, 12);
  const auto above = seen_from(two.sensors[0], positions), below = seen_from(two.sensors[1], positions, 2);
  const MatchResult result = matcher.match(std::vector<Frame>{at(1, above), at(1, below)});
  CHECK(distance(two.model, result, positions) < 1e-3);
  CHECK(matcher.rigs()[1].is_used);
}

TEST_CASE("a model that was baked for several rigs has the views of each") {
  const auto rendering = [](const StereoSensor& rig) {
    return [rig](const CommonMesh& mesh, const std::array<float, 3>& low, const std::array<float, 3>& high) {
      return make_depth_renderer(rig, mesh.node_ids.size(), mesh.elements, low, high);
    };
  };
  const TemporaryFolder folder;
  BakeOptions of_both, of_below;
  of_both.depth_renderer = rendering(rig_above());
  of_both.more_depth_renderers = {rendering(rig_below())};
  of_below.depth_renderer = rendering(rig_below());
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "both.lbea", of_both);
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "below.lbea", of_below);
  const Model both = Model::open(folder / "both.lbea"), other = Model::open(folder / "below.lbea");
  const RigidTransform above_pose = rig_above().T_reference_sensor, below_pose = rig_below().T_reference_sensor;
  CHECK(SensorViews::baked_into(both).T_reference_sensor() == above_pose);
  CHECK(SensorViews::baked_into(both, above_pose).T_reference_sensor() == above_pose);
  const SensorViews below = SensorViews::baked_into(both, below_pose), expected = SensorViews::baked_into(other);
  CHECK(below.T_reference_sensor() == below_pose);
  CHECK(std::ranges::equal(below.data()->depths, expected.data()->depths));
  CHECK(std::ranges::equal(below.data()->expected, expected.data()->expected));
  CHECK(std::ranges::equal(below.data()->regression.weights, expected.data()->regression.weights));
  CHECK(below.misfit_limit() == expected.misfit_limit());
  REQUIRE(below.data()->bounds.size() == expected.data()->bounds.size());
  for (std::size_t i = 0; i < below.data()->bounds.size(); ++i)
    CHECK(below.data()->bounds[i].per_spread == expected.data()->bounds[i].per_spread);

  RigMatcher by_model(both, fit_config(), {{above_pose}, {below_pose}});
  RigMatcher by_views(both, fit_config(), {{above_pose}, {below_pose, expected}});
  for (const std::uint32_t sample : {12u, 13u, 14u}) {
    const std::vector<float> positions = positions_of(both, sample);
    const auto from_above = seen_from(rig_above(), positions), from_below = seen_from(rig_below(), positions, 2);
    const std::vector<Frame> frames{at(sample, from_above), at(sample, from_below)};
    const MatchResult result = by_model.match(frames), same = by_views.match(frames);
    CHECK(by_model.rigs()[1].is_used);
    CHECK(result.matches.front().sample == same.matches.front().sample);
    CHECK(result.fit.misfit == same.fit.misfit);
    CHECK(distance(both, result, positions) < 1e-3);
  }
  // One rig alone, which is not the first.
  MatcherConfig config = fit_config();
  config.T_reference_sensor = below_pose;
  Matcher matcher(both, config);
  const auto seen = seen_from(rig_below(), positions_of(both, 12));
  CHECK(matcher.match({0, 0, seen}).matches.front().sample == both.sample(12));
}

TEST_CASE("rigs that cannot be matched are refused with their number") {
  TwoRigs two;
  const auto refused = [&](const std::vector<Rig>& rigs) -> std::string {
    try {
      RigMatcher matcher(two.model, fit_config(), rigs);
    } catch (const Error& error) {
      CHECK(error.status == Status::bad_config);
      return error.what();
    }
    return "accepted";
  };
  CHECK(refused({}).starts_with("0 rigs"));
  CHECK(refused(std::vector<Rig>(17, two.rigs[0])).starts_with("17 rigs"));
  Rig mirrored = two.rigs[1];
  mirrored.T_reference_sensor[0] = -1;
  CHECK(refused({two.rigs[0], mirrored}).starts_with("rig 2: "));
  const AlignedBytes other_bytes = seen_plates_model(4, 12);  // as many samples
  const Model other = Model::view(other_bytes.span());
  REQUIRE(other.samples() == two.model.samples());
  Rig of_other = two.rigs[1];
  of_other.views = views_from(two.sensors[1], other);
  CHECK(refused({two.rigs[0], of_other}).find("not those of the same model") != std::string::npos);
}
