// The time of a test: when the impact was, and how certain that is.
#include "runtime/src/depth/test_clock.hpp"
#include "tests/runtime/track/stamps.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>

using namespace lbea;
using namespace lbea::test;

namespace {

/// Of simulations of 10 ms with states every 0.5 ms; similar samples are 10 % late or early.
TestClock clock_of_10_ms() { return {{.impact_s = 0, .duration_s = 0.01, .interval_s = 0.0005}, 0.1}; }

}  // namespace

TEST_CASE("the impact's stamp follows from the times of the first deformed frames, in any clock") {
  for (const std::int64_t impact : {std::int64_t{0}, 1'700'000'000'000 * millisecond, -5 * millisecond})
    for (const double pace : {0.9, 1.0, 1.1}) {  // of the component, compared with the samples like it
      TestClock clock = clock_of_10_ms();
      CHECK(clock.since_impact(impact).variance == 0);
      for (int frame = -10; frame < 20; ++frame) {
        const std::int64_t stamp = impact + frame * millisecond / 2;
        clock.add(stamp, {std::max(0.0, pace * frame * 0.5e-3), 0});
        if (frame < 3) continue;
        const TimeBelief time = clock.since_impact(stamp);
        CHECK(std::abs(time.mean_s - frame * 0.5e-3) <= std::sqrt(time.variance));  // a pace of one deviation
        CHECK(std::sqrt(time.variance) < 0.4e-3);
        CHECK(clock.of_samples(stamp).variance > time.variance);
      }
    }
}

TEST_CASE("uncertain frames count little, and a wrong first one is forgotten when all others contradict it") {
  TestClock clock = clock_of_10_ms();
  clock.add(millisecond, {1e-3, 0});
  clock.add(2 * millisecond, {1e-3, 1e-4});  // a second late, give or take 10 ms
  CHECK(clock.since_impact(2 * millisecond).mean_s == doctest::Approx(2e-3).epsilon(0.01));
  TestClock without_stamps = clock_of_10_ms();
  for (int frame = 1; frame < 20; ++frame) {
    without_stamps.add(0, {frame * 0.5e-3, 0});
    CHECK(without_stamps.of_samples(0).variance == 0);
  }
  TestClock wrong = clock_of_10_ms();
  wrong.add(-50 * millisecond, {3e-3, 0});
  for (int frame = 2; frame < 14; ++frame) wrong.add(frame * millisecond / 4, {frame * 0.25e-3, 0});
  CHECK(wrong.since_impact(3 * millisecond).mean_s == doctest::Approx(3e-3).epsilon(0.05));
}

// The clock restarted again and again while the component was at rest in its last state, or looked like several of the
// first ones.
TEST_CASE("frames before the impact and after the simulations' end do not change the clock") {
  TestClock clock = clock_of_10_ms();
  for (int frame = -1000; frame < 0; ++frame) {
    clock.add(frame * millisecond, {0.75e-3, 0.5e-6});  // any of the states up to 2 ms
    CHECK(clock.since_impact(0).variance == 0);
  }
  for (int frame = 1; frame < 100; ++frame) {
    clock.add(frame * millisecond, {std::min(frame * 1e-3, 0.01), 0});
    if (frame > 2) CHECK(clock.since_impact(frame * millisecond).mean_s == doctest::Approx(frame * 1e-3).epsilon(0.01));
  }
  TestClock late = clock_of_10_ms();
  for (int frame = 0; frame < 100; ++frame) {
    late.add(frame * millisecond, {0.01, 0});
    CHECK(late.since_impact(frame * millisecond + 1).variance == 0);
  }
}

// A frame stamped a minute late passed the test of four deviations, which grow with the time since the impact, and made
// the clock more certain.
TEST_CASE("an impossible stamp does not make the clock more certain") {
  TestClock clock = clock_of_10_ms();
  for (int frame = 1; frame < 6; ++frame) clock.add(frame * millisecond / 2, {frame * 0.5e-3, 0});
  const TimeBelief before = clock.since_impact(3 * millisecond);
  REQUIRE(before.variance > 0);
  for (const std::int64_t late : {60'000 * millisecond, 4'000'000'000'000 * millisecond}) {
    clock.add(late, {3e-3, 0});
    CHECK(clock.since_impact(3 * millisecond).variance == before.variance);
    CHECK(clock.since_impact(3 * millisecond).mean_s == before.mean_s);
  }
}

// An impact in seconds gave frames 1.7e9 s after it, within a microsecond.
TEST_CASE("times of more than 10,000 durations are not known") {
  TestClock clock = clock_of_10_ms();
  clock.set_impact(1'700'000'000);
  CHECK(clock.since_impact(1'700'000'000'000 * millisecond).variance == 0);
  CHECK(clock.since_impact(1'700'000'000 + 5 * millisecond).mean_s == doctest::Approx(5e-3));
  CHECK(clock.since_impact(std::numeric_limits<std::int64_t>::min()).variance == 0);
}

TEST_CASE("a known impact is kept; without a learned variation there is no clock") {
  TestClock known = clock_of_10_ms();
  known.set_impact(7 * millisecond);
  for (int frame = 0; frame < 9; ++frame) known.add(frame * millisecond, {frame * 1e-3, 0});
  known.reset();
  CHECK(known.since_impact(9 * millisecond).mean_s == doctest::Approx(2e-3));
  TestClock none({.impact_s = 0, .duration_s = 0.01, .interval_s = 0.0005}, 0);
  none.add(millisecond, {1e-3, 0});
  CHECK(none.of_samples(2 * millisecond).variance == 0);
  none.set_impact(0);
  CHECK(none.of_samples(2 * millisecond).variance == 0);
}

TEST_CASE("a test whose first frame may be undeformed begins shortly before it") {
  constexpr double unknown = std::numeric_limits<double>::infinity();
  TestClock clock = clock_of_10_ms();
  CHECK(clock.latest(0).mean_s == 0);
  CHECK(clock.latest(0).variance == doctest::Approx(1e-6));  // a tenth of 10 ms
  clock.begin(5 * millisecond, 0);
  clock.begin(6 * millisecond, unknown);  // only the first frame counts
  CHECK(clock.latest(8 * millisecond).mean_s == doctest::Approx(3e-3));
  CHECK(clock.latest(5 * millisecond).variance == 0);  // without stamps
  clock.add(8 * millisecond, {1e-3, 0});
  CHECK(clock.latest(9 * millisecond).variance == 0);
  for (int frame = 0; frame < 5; ++frame) clock.add(1'000 * millisecond, {1e-3, 0});  // contradict it: it starts again
  REQUIRE(clock.since_impact(1'000 * millisecond + 1).variance == 0);
  CHECK(clock.latest(9 * millisecond).variance == 0);
  clock.reset();
  CHECK(clock.latest(0).variance > 0);
  clock.begin(0, unknown);
  CHECK(clock.latest(millisecond).variance == 0);
  clock.reset();
  clock.begin(0, 4e-3);
  CHECK(clock.latest(millisecond).mean_s == doctest::Approx(5e-3));
  clock.set_impact(0);
  clock.reset();
  CHECK(clock.latest(millisecond).variance == 0);
}
