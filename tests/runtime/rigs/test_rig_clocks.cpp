// Two rigs whose clocks differ.
#include "tests/runtime/rigs/two_rigs.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::test;

namespace {

/// Three runs of 41 states at intervals of 0.5 ms, whose times the bakes have learned to trust.
struct ClockedRigs : TwoRigs {
  ClockedRigs() : TwoRigs(41, 3) {
    for (Rig& rig : rigs) {
      if (rig.views.empty()) rig.views = SensorViews::baked_into(model);
      rig.views = changed(rig.views, [](DepthImages& images) { images.time_variation = 0.02f; });
    }
  }

  [[nodiscard]] double interval_ms() const { return 1e3 * (model.sample_time_s(1) - model.sample_time_s(0)); }
  /// A plate of the second run at a time, which is undeformed before the impact.
  [[nodiscard]] std::vector<float> shape_at(double ms) const {
    const auto states = static_cast<double>(model.samples() / model.simulations() - 1);
    return bent(0.6 * std::clamp(ms / interval_ms() / states, 0.0, 1.0));
  }
  /// The second rig's clock is behind; its frames are those that the matcher takes for simultaneous.
  MatchResult capture(RigMatcher& matcher, double ms, double behind_ms) const {
    const double stamp_ms = ms - 1e-6 * static_cast<double>(matcher.rigs()[1].clock_correction_ns);
    const auto above = seen_from(sensors[0], shape_at(ms));
    const auto below = seen_from(sensors[1], shape_at(stamp_ms + behind_ms));
    return matcher.match(std::vector<Frame>{at(ms, above), at(stamp_ms, below)});
  }
};

double correction_ms(const RigMatcher& matcher) {
  return 1e-6 * static_cast<double>(matcher.rigs()[1].clock_correction_ns);
}

}  // namespace

// Clocks that differ by 3 ms made three times the best sample's error of two rigs that had 0.98 of it.
TEST_CASE("a clock that is behind or ahead is found by the impact, and results rest on both rigs again") {
  const ClockedRigs two;
  RigMatcher matcher = two.matcher();
  for (const double behind_ms : {-6.0, -3.1, -1.2, 1.2, 3.1, 6.0}) {
    CAPTURE(behind_ms);
    matcher.reset();
    CHECK(matcher.rigs()[1].clock_correction_ns == 0);
    MatchResult result;
    double ms = -7;
    for (; ms < 14; ms += 0.77) result = two.capture(matcher, ms, behind_ms);
    CHECK(std::abs(correction_ms(matcher) - behind_ms) < two.interval_ms() / 2);
    CHECK(std::abs(double{result.fit.test_time} - 1e-3 * (ms - 0.77)) < 1e-3 * two.interval_ms());
    for (const RigResult& rig : matcher.rigs()) CHECK(rig.is_used);
    CHECK(result.verdict != Verdict::no_simulation_fits);
  }
}

TEST_CASE("stamps of clocks that agree are not changed") {
  const ClockedRigs two;
  RigMatcher matcher = two.matcher();
  for (double ms = -2; ms < 14; ms += 0.77) {
    (void)two.capture(matcher, ms, 0);
    CHECK(matcher.rigs()[1].clock_correction_ns == 0);
    for (const RigResult& rig : matcher.rigs()) CHECK(rig.is_used);
  }
}

// Where something hides what deforms from a rig, it looks as if its clock were behind.
TEST_CASE("a rig that does not see the impact counts again after two fifths of a simulation") {
  const ClockedRigs two;
  RigMatcher matcher = two.matcher();
  const auto below = seen_from(two.sensors[1], two.shape_at(0));
  for (double ms = -2; ms < 14; ms += 0.5) {
    CAPTURE(ms);
    const auto above = seen_from(two.sensors[0], two.shape_at(ms));
    const MatchResult result = matcher.match(std::vector<Frame>{at(ms, above), at(ms, below)});
    CHECK(result.status == Status::ok);
    CHECK(matcher.rigs()[1].clock_correction_ns == 0);
    CHECK(matcher.rigs()[0].is_used);
    if (ms < 1 || ms > 9) CHECK(matcher.rigs()[1].is_used);
    if (ms > 3 && ms < 7) CHECK_FALSE(matcher.rigs()[1].is_used);
  }
}

// Each rig's first frame was taken for the stamp of the impact.
TEST_CASE("frames without stamps, and rigs that begin late, leave the clocks alone") {
  const ClockedRigs two;
  RigMatcher matcher = two.matcher();
  for (double ms = 0; ms < 10; ms += 0.77) {
    const auto above = seen_from(two.sensors[0], two.shape_at(ms)), below = seen_from(two.sensors[1], two.shape_at(ms));
    const Frame of_second = ms > 3 ? at(0, below) : Frame{};
    (void)matcher.match(std::vector<Frame>{at(0, above), of_second});
    CHECK(matcher.rigs()[1].clock_correction_ns == 0);
  }
  matcher.reset();
  for (double ms = 0; ms < 10; ms += 0.77) {
    const auto above = seen_from(two.sensors[0], two.shape_at(ms)), below = seen_from(two.sensors[1], two.shape_at(ms));
    (void)matcher.match(std::vector<Frame>{at(ms, above), ms > 3 ? at(ms, below) : Frame{}});
    CHECK(matcher.rigs()[1].clock_correction_ns == 0);
  }
}
