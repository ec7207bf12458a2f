// The pose error of a test: what is estimated from its frames is what they were moved by.
#include "runtime/src/depth/pose.hpp"
#include "tests/runtime/seen_plates.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <numbers>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

const PoseCenter plate_center{{95, 45, 0}, 60};

Point moved(const RigidTransform& T, const Point& p) {
  return {T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3], T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],
          T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
}

}  // namespace

TEST_CASE("a motion turns about the middle and shifts it") {
  const double quarter = std::numbers::pi / 2 * plate_center.arm;
  const RigidTransform T = transform_of({0, 0, quarter, 1, 2, 3}, plate_center);
  const Point middle = moved(T, {95, 45, 0}), beside = moved(T, {105, 45, 0});
  CHECK(middle.x == doctest::Approx(96));
  CHECK(middle.y == doctest::Approx(47));
  CHECK(middle.z == doctest::Approx(3));
  CHECK(beside.x == doctest::Approx(96));
  CHECK(beside.y == doctest::Approx(57));
}

TEST_CASE("frames that agree make the pose certain; a frame that says less than they do changes it little") {
  PoseFilter filter(plate_center, 1);
  const auto measure = [&](double shift, double information) {
    filter.begin_frame();
    do {
      const PoseBelief prior = filter.prior();
      PoseBelief posterior = prior;
      const double missing = shift - double{filter.shift()};
      posterior.information[35] += information;
      posterior.mean[5] = (prior.information[35] * prior.mean[5] + information * missing) / posterior.information[35];
      if (!filter.move(posterior)) return;
    } while (true);
  };
  measure(4, 1000);
  CHECK(filter.shift() == doctest::Approx(4).epsilon(0.01));
  const float before = filter.shift();
  measure(5, 10);  // alone it moves the mean by 10 / 1010; with what it says discounted, by a hundredth of that
  CHECK(filter.shift() - before > 0);
  CHECK(filter.shift() - before < 10.0 / 1010 / 50);
  filter.reset();
  CHECK(filter.transform() == identity_transform);
}

// Regression: a pose at which a frame had no points was kept, and all later frames of the test were empty.
TEST_CASE("a pose that cannot be right is given up, first for that of the frames before, then for none") {
  PoseFilter filter(plate_center, 1);
  PoseBelief far = filter.prior();
  far.mean[5] = 1e6;
  far.information[35] = 1e9;
  CHECK(filter.move(far));  // back, and once more from there
  CHECK(filter.shift() == 0);
  CHECK(!filter.move(far));  // not again in this frame
  CHECK(filter.shift() == 0);
  filter.begin_frame();
  far.mean[5] = std::numeric_limits<double>::quiet_NaN();
  CHECK(filter.move(far));
  CHECK(filter.shift() == 0);
  filter.begin_frame();
  PoseBelief near = filter.prior();
  near.mean[5] = 0.2;
  near.information[35] = 1e9;
  CHECK(!filter.move(near));
  CHECK(filter.shift() > 0.1f);
  CHECK(filter.retreat());
  CHECK(filter.shift() == 0);
  CHECK(!filter.retreat());
}

// The whole motion is in the demo's test of lbea-eval: a plate that bends about one edge looks like one that is turned.
TEST_CASE("where deformed shapes look like moved ones, the bake turns the estimate of the pose off") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  TestPose pose(model);
  CHECK(!pose.is_estimated());
  const std::vector<Point> points = seen(bent(0.15));
  const MatchResult with = Matcher(model, fit_config()).match({.points = points}, pose);
  CHECK(with.status == Status::ok);
  CHECK(std::isnan(with.fit.pose_shift));
  CHECK(pose.correction() == identity_transform);
}
