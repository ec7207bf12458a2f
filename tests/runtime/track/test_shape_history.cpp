// Which earlier shapes are remembered, and the cost of samples that do not continue them.
#include "runtime/src/depth/test_clock.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/runtime/track/stamps.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::test;

namespace {

/// Two simulations of 5 states, 1 ms apart: the first shape score grows by 1, and by 3, per state.
struct TwoSimulations {
  std::vector<std::array<std::uint32_t, 2>> samples;
  std::vector<double> times;
  std::vector<float> shapes;
  ModelView view;
  DepthImages images;

  TwoSimulations() {
    for (std::uint32_t simulation = 0; simulation < 2; ++simulation)
      for (std::uint32_t state = 0; state < 5; ++state) {
        samples.push_back({simulation, state});
        times.push_back(1e-3 * state);
        shapes.resize(shapes.size() + ShapeRegression::shape_scores);
        shapes[shapes.size() - ShapeRegression::shape_scores] = static_cast<float>(state * (simulation == 0 ? 1 : 3));
      }
    view.samples = samples;
    view.sample_times = times;
    images.regression.shapes = shapes;
    images.regression.blend = 0.5f;
  }
};

std::vector<RankedSample> all_samples() {
  std::vector<RankedSample> all;
  for (std::uint32_t sample = 0; sample < 10; ++sample) all.push_back({sample, 0});
  return all;
}

}  // namespace

TEST_CASE("the shapes one to three tenths of a simulation ago are remembered, in a stream of any rate") {
  for (const std::int64_t interval : {1, 20, 100, 3000}) {  // microseconds
    ShapeHistory history(0.01);
    for (std::int64_t stamp = 0; stamp < 10 * millisecond; stamp += interval * 1000) {
      const EarlierShapes shapes = history.before(stamp);
      for (std::size_t i = 0; i < shapes.size(); ++i) {
        const std::int64_t least = static_cast<std::int64_t>(i + 1) * std::max(millisecond, interval * 1000);
        const std::int64_t age = shapes[i] != nullptr ? stamp - shapes[i]->stamp_ns : 0;
        CHECK((shapes[i] == nullptr) == (stamp < least));
        // A shape is added every 0.25 ms, or with every frame when these are farther apart.
        if (shapes[i] != nullptr) CHECK((age >= least && age <= least + 250'000 + 2 * interval * 1000));
      }
      history.add(shape_at(stamp));
    }
  }
}

TEST_CASE("frames without stamps, of the future or of long ago are no evidence about a frame") {
  ShapeHistory history(0.01);
  for (int frame = 0; frame < 5; ++frame) {
    CHECK(history.before(0)[0] == nullptr);
    history.add(shape_at(0));
  }
  CHECK(history.before(-5 * millisecond)[0] == nullptr);
  CHECK(history.before(10 * millisecond)[0] != nullptr);
  CHECK(history.before(11 * millisecond)[0] == nullptr);
  history.add(shape_at(-9 * millisecond));  // a late frame: not added
  CHECK(history.before(5 * millisecond)[0]->stamp_ns == 0);
  history.add(shape_at(-11 * millisecond));  // the clock was set back
  CHECK(history.before(-9 * millisecond)[0]->stamp_ns == -11 * millisecond);
  history.reset();
  CHECK(history.before(-9 * millisecond)[0] == nullptr);
}

TEST_CASE("a sample costs as much as its simulation differed from the earlier shape") {
  const TwoSimulations two;
  ExpectationCosts costs(two.view, two.images.regression);
  EarlierShape earlier = shape_at(0, 1);
  earlier.scores[0] = 2.5f;  // simulation 0 at 2.5 ms
  FrameExpectation expected{1'500'000, {&earlier}};
  costs.assess(all_samples(), &expected);
  CHECK(costs[4] == 0);                             // 4 ms less 1.5 ms: the earlier shape itself
  CHECK(costs[3] == doctest::Approx(0.25));         // by 1: the error of the earlier shape
  CHECK(costs[2] == doctest::Approx(0.25 * 4));     // by 2
  CHECK(costs[0] == doctest::Approx(0.25 * 6.25));  // before its first state a simulation does not change
  CHECK(costs[7] == doctest::Approx(0.25 * 1));     // the other one after 0.5 ms: 1.5
  CHECK(costs[9] == doctest::Approx(0.25 * 25));    // by 5
  expected.earlier[1] = &earlier;
  costs.assess(all_samples(), &expected);
  CHECK(costs[2] == doctest::Approx(0.25 * 8));  // the same by two shapes
  CHECK(costs[9] == 8);                          // the most
  costs.assess(all_samples(), nullptr);
  CHECK(costs[9] == 0);
}

TEST_CASE("a sample costs as much as its time differs from that of the frame") {
  const TwoSimulations two;
  ExpectationCosts costs(two.view, two.images.regression);
  const FrameExpectation expected{0, {}, {2e-3, 1e-6}};
  costs.assess(all_samples(), &expected);
  for (const std::uint32_t first : {0u, 5u})
    for (std::uint32_t state = 0; state < 5; ++state)
      CHECK(costs[first + state] == doctest::Approx(0.5 * (state - 2.0) * (state - 2.0)));
  EarlierShape earlier = shape_at(0, 1);
  earlier.scores[0] = 9;  // simulation 1 at 3 ms
  const FrameExpectation contradictory{0, {&earlier}, {-1, 1e-6}};
  costs.assess(all_samples(), &contradictory);
  CHECK(costs[8] == 4);  // the most by the time alone
  for (const bool is_first : {true, false}) {
    costs.assess(all_samples(), std::array{FrameExpectation{0, {}, {}, {-1, 1e-6}, is_first}}.data());
    CHECK(costs[8] == (is_first ? 8 : 4));  // the time of a first frame is all that is known
    costs.assess(all_samples(), std::array{FrameExpectation{0, {}, {-1, 1e-6}, {}, is_first}}.data());
    CHECK(costs[8] == 4);  // of an impact that is known
    costs.assess(all_samples(), std::array{FrameExpectation{0, {&earlier}, {}, {-1, 1e-6}, is_first}}.data());
    CHECK(costs[8] == 4);  // where another rig has seen earlier frames
  }
}

TEST_CASE("earlier shapes propose what their simulations show at the time of the frame, and the states beside it") {
  const TwoSimulations two;
  ContinuedSamples continued(two.view);
  const auto found = [&](const EarlierShapes& earlier, std::int64_t stamp_ns) {
    std::vector<std::uint32_t> samples;
    for (const RankedSample& one : continued.find({stamp_ns, earlier})) samples.push_back(one.sample);
    return samples;
  };
  using Samples = std::vector<std::uint32_t>;
  EarlierShape shape = shape_at(0), older = shape_at(-millisecond);
  shape.similar = {6, 1};  // at 1 ms, of both simulations
  CHECK(found({}, millisecond).empty());
  CHECK(found({&shape}, millisecond).empty());  // similar to none
  shape.similar_count = 1;
  CHECK(found({&shape}, millisecond) == Samples{6, 7, 8});
  CHECK(found({&shape}, 3 * millisecond) == Samples{8, 9});   // the last state
  CHECK(found({&shape}, 30 * millisecond) == Samples{8, 9});  // remains
  CHECK(found({&shape}, -millisecond) == Samples{5, 6});      // the first one
  shape.similar_count = 2;
  CHECK(found({&shape}, millisecond) == Samples{6, 7, 8, 1, 2, 3});
  older.similar = {1};
  older.similar_count = 1;
  CHECK(found({&shape, &older}, millisecond) == Samples{6, 7, 8, 1, 2, 3, 4});  // each once
}

TEST_CASE("times count from the first state, and intervals are those between states") {
  TwoSimulations two;
  for (double& time : two.times) time += 5e-3;
  two.view.sample_times = two.times;
  const EnsembleTimes times = EnsembleTimes::of(two.view);
  CHECK(times.impact_s == doctest::Approx(5e-3));
  CHECK(times.duration_s == doctest::Approx(4e-3));
  CHECK(times.interval_s == doctest::Approx(1e-3));
}

TEST_CASE("only samples later than the latest cost") {
  const TwoSimulations two;
  ExpectationCosts costs(two.view, two.images.regression);
  const FrameExpectation expected{0, {}, {}, {2e-3, 1e-6}};
  costs.assess(all_samples(), &expected);
  for (std::uint32_t state = 0; state < 5; ++state)
    CHECK(costs[state] == doctest::Approx(state < 3 ? 0.0 : 0.5 * (state - 2.0) * (state - 2.0)));
}
