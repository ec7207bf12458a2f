// The poses of several rigs around bending plates, and the steps of a capture on several threads.
#include "tests/runtime/rigs/two_rigs.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <bit>
#include <cmath>
#include <thread>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// The bakes have learned how certain poses are.
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

}  // namespace

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
    CHECK(same(std::array{result.coverage, divided.rigs()[0].coverage, divided.rigs()[1].coverage},
               std::array{expected.coverage, alone.rigs()[0].coverage, alone.rigs()[1].coverage}));
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
  two.rigs[0].views =
      changed(two.rigs[0].views, [](DepthImages& images) { images.misfit_limit = 10; });  // explains any frame
  PosedRigs by_images = two;
  by_images.rigs[0].views =
      changed(by_images.rigs[0].views, [](DepthImages& images) { images.pose_errors_by_points = std::nullopt; });
  for (const std::uint32_t sample : {3u, 20u, 37u, 47u}) {
    CAPTURE(sample);
    const std::vector<float> positions = positions_of(two.model, sample);
    auto above = seen_from(two.sensors[0], positions);
    for (Point& p : above) p.z += 2;
    above = one_per_quarter(above, two.rigs[0].views.data()->camera);
    const auto below = seen_from(two.sensors[1], positions, 2);
    RigMatcher matcher(two.model, fit_config(), two.rigs), expected(two.model, fit_config(), by_images.rigs);
    for (int frame = 0; frame < 6; ++frame)
      for (RigMatcher* const each : {&matcher, &expected})
        (void)each->match(std::vector<Frame>{at(0.1 * frame, above), at(0.1 * frame, below)});
    REQUIRE(matcher.rigs()[0].is_used);
    CHECK(matcher.pose_correction(0) == expected.pose_correction(0));
    CHECK(matcher.rigs()[0].pose_shift > 0.5f);
  }
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
