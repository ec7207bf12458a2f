// The pose by the points: the motion beside the deformations of the samples.
#include "runtime/src/fit/surface_pose.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace lbea;

namespace {

constexpr std::size_t stride = 256, samples = 3;
const PoseCenter center{{10, -5, 3}, 40};
const PoseMotion calibration{400, 400, 400, 100, 100, 100};
constexpr float mesh_noise = 0.3f;

/// Nodes around the center whose normals look everywhere; the samples differ at the first half of the nodes alone.
struct Surface {
  std::vector<float> shape = std::vector<float>(3 * stride);
  std::vector<float> directions = std::vector<float>(4 * stride);  // normals; no edges
  std::vector<float> distances = std::vector<float>(stride), rows = std::vector<float>(samples * stride);

  explicit Surface(float difference) {
    std::mt19937 random(7);
    std::normal_distribution<float> normal;
    for (std::size_t i = 0; i < stride; ++i) {
      std::array<float, 3> n{normal(random), normal(random), normal(random)};
      const float length = std::hypot(n[0], n[1], n[2]);
      for (std::size_t axis = 0; axis < 3; ++axis) {
        directions[axis * stride + i] = n[axis] / length;
        shape[axis * stride + i] = static_cast<float>(center.middle[axis]) + 40 * normal(random);
      }
      if (i < stride / 2)
        for (std::size_t s = 0; s < samples; ++s) rows[s * stride + i] = difference * normal(random);
    }
  }

  /// The cloud lacks this motion: its points lie where the inverse motion takes the surface.
  void lack(const PoseMotion& motion) {
    for (std::size_t i = 0; i < stride; ++i) {
      std::array<double, 3> p{}, n{};
      for (std::size_t axis = 0; axis < 3; ++axis) {
        p[axis] = (double{shape[axis * stride + i]} - center.middle[axis]) / center.arm;
        n[axis] = double{directions[axis * stride + i]};
      }
      const double turned[] = {motion[1] * p[2] - motion[2] * p[1], motion[2] * p[0] - motion[0] * p[2],
                               motion[0] * p[1] - motion[1] * p[0]};
      for (std::size_t axis = 0; axis < 3; ++axis)
        distances[i] -= static_cast<float>(n[axis] * (turned[axis] + motion[3 + axis]));
    }
  }

  [[nodiscard]] PoseMeasurement measured() const {
    SurfacePose pose(center, mesh_noise, stride, FitSettings{});
    return pose.measure({shape, directions, distances, rows, samples, stride, stride, 1}, calibration);
  }
};

double greatest_error(const PoseMeasurement& measured, const PoseMotion& motion) {
  double greatest = 0;
  for (std::size_t i = 0; i < 6; ++i) greatest = std::max(greatest, std::abs(measured.motion[i] - motion[i]));
  return greatest;
}

const PoseMotion motion{0.5, -0.3, 0.2, 0.4, -0.6, 0.1};  // length units

}  // namespace

TEST_CASE("the points tell the motion that the cloud lacks") {
  for (const float difference : {0.0f, 2.0f}) {
    CAPTURE(difference);
    Surface surface(difference);
    surface.lack(motion);
    const PoseMeasurement measured = surface.measured();
    // The bound of the calibration draws it toward none: relative to that, by the ratio of the variances.
    for (std::size_t i = 0; i < 6; ++i) CHECK(std::sqrt(measured.covariance[7 * i]) < 0.2);
    CHECK(greatest_error(measured, motion) < 1e-3);
  }
}

TEST_CASE("a deformation that the samples have is no motion") {
  Surface surface(2);
  surface.lack(motion);
  for (std::size_t i = 0; i < stride; ++i)
    surface.distances[i] += 0.4f * surface.rows[i] - 0.3f * surface.rows[stride + i];
  CHECK(greatest_error(surface.measured(), motion) < 0.02);
}

// Unseen runs seemed to be moved by 1.7 degrees where folds lie elsewhere than in the samples.
TEST_CASE("nodes at which the samples differ count less: a shape that no sample has there is hardly a motion") {
  const auto error_with = [](float difference) {
    Surface surface(difference);
    for (std::size_t i = 0; i < stride / 2; ++i) surface.distances[i] += 1;
    return greatest_error(surface.measured(), {});
  };
  CHECK(error_with(0) > 0.1);
  CHECK(error_with(10) < error_with(0) / 20);
}

TEST_CASE("the covariance is that of the measured motions") {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.2f);
  constexpr int trials = 2000;
  double ratio = 0;  // squared error over variance
  for (int trial = 0; trial < trials; ++trial) {
    Surface surface(0);
    for (float& distance : surface.distances) distance += noise(random);
    const PoseMeasurement measured = surface.measured();
    const PoseMotion moved = PoseFactor(measured.covariance).forward(measured.motion);
    for (const double one : moved) ratio += one * one / 6 / trials;
  }
  // Chi squared of 12,000 degrees of freedom: 1.3 % standard deviation; the variance is that of the noise and a third
  // of the mesh noise
  const double expected = 0.04 / (0.04 + 0.01);
  CHECK(ratio == doctest::Approx(expected).epsilon(0.1));
}

TEST_CASE("a strip that the cloud lacks along all edges is no motion") {
  for (const bool knows_edges : {true, false}) {
    Surface surface(0);
    for (std::size_t i = 0; i < stride; ++i) {
      const std::size_t kind = i % 4;  // a plane across z; edges at the end of x, at both sides in y
      const std::array<float, 3> direction{kind == 1 ? 1.0f : 0.0f, kind == 2 ? 1.0f : (kind == 3 ? -1.0f : 0.0f),
                                           kind == 0 ? 1.0f : 0.0f};
      for (std::size_t axis = 0; axis < 3; ++axis) surface.directions[axis * stride + i] = direction[axis];
      surface.directions[3 * stride + i] = kind != 0 && knows_edges ? 1.0f : 0.0f;
      surface.distances[i] = kind != 0 ? -1.0f : 0.0f;
    }
    const double shift = surface.measured().motion[3];  // x
    CAPTURE(shift);
    if (knows_edges)
      CHECK(std::abs(shift) < 0.1);
    else
      CHECK(shift > 0.5);
  }
}

// Rounded sums made motions across the normal of a tilted plane of 1e26 length units.
TEST_CASE("a plane tells its shift along the normal and no other") {
  std::mt19937 random(5);
  std::normal_distribution<float> noise(0, 0.1f);
  for (const std::array<float, 3>& normal :
       {std::array{0.48f, 0.6f, 0.64f}, std::array{0.28f, -0.96f, 0.0f}, std::array{0.267261f, 0.534522f, 0.801784f}}) {
    Surface surface(0);
    for (std::size_t i = 0; i < stride; ++i) {
      const float along = normal[0] * surface.shape[i] + normal[1] * surface.shape[stride + i] +
                          normal[2] * surface.shape[2 * stride + i];
      for (std::size_t axis = 0; axis < 3; ++axis) {
        surface.directions[axis * stride + i] = normal[axis];
        surface.shape[axis * stride + i] -= along * normal[axis];  // onto the plane
      }
      surface.distances[i] = 0.3f + noise(random);
    }
    PoseMeasurement rough;
    for (std::size_t i = 0; i < 6; ++i) rough.covariance[7 * i] = 1;
    const PoseMotion found = surface.measured().together_with(rough).motion;
    CHECK(length_of(PoseFactor(surface.measured().covariance).forward(surface.measured().motion)) < 100);
    double shift = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) shift += found[3 + axis] * double{normal[axis]};
    CHECK(shift == doctest::Approx(-0.3).epsilon(0.2));  // 60 mm from the middle, turns take a part of the noise
    for (std::size_t axis = 0; axis < 3; ++axis)
      CHECK(found[3 + axis] == doctest::Approx(shift * double{normal[axis]}).epsilon(0.2).scale(1));
  }
}

TEST_CASE("two independent measurements together are the weighted mean") {
  PoseMeasurement a, b;
  for (std::size_t i = 0; i < 6; ++i) a.covariance[7 * i] = 1, b.covariance[7 * i] = 3, b.motion[i] = 4;
  const PoseMeasurement both = a.together_with(b);
  for (std::size_t i = 0; i < 6; ++i) {
    CHECK(both.motion[i] == doctest::Approx(1));
    CHECK(both.covariance[7 * i] == doctest::Approx(0.75));
  }
}
