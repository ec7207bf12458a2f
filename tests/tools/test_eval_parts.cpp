// Parts of the evaluation by their definitions: splits, scores, disturbances, inference, ICP.
#include "adapters/simulation/open.hpp"
#include "runtime/src/track/inference.hpp"
#include "tests/mapping/meshes.hpp"
#include "tests/support/eroding_plates.hpp"
#include "tests/support/files.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/eval/evaluation.hpp"
#include "tools/eval/evaluation_report.hpp"
#include "tools/eval/experiments.hpp"
#include "tools/eval/icp_baseline.hpp"
#include "tools/eval/live.hpp"
#include "tools/eval/mesh_series.hpp"
#include "tools/eval/truth.hpp"

#include <lbea/inference.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <sstream>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

std::vector<EnsembleRun> runs_named(std::initializer_list<const char*> names) {
  std::vector<EnsembleRun> runs;
  for (const char* name : names) runs.push_back({name, {}, {}});
  return runs;
}

void check_partition(const Split& split, std::size_t runs) {
  std::vector<std::size_t> all(split.simulations);
  all.insert(all.end(), split.experiments.begin(), split.experiments.end());
  std::ranges::sort(all);
  std::vector<std::size_t> expected(runs);
  std::iota(expected.begin(), expected.end(), std::size_t{0});
  CHECK(all == expected);
  CHECK(std::ranges::is_sorted(split.simulations));
  CHECK(std::ranges::is_sorted(split.experiments));
}

struct Plates {
  TemporaryFolder folder;
  Model model = opened();

 private:
  [[nodiscard]] Model opened() const {
    bake_bent_plates(folder / "plates.lbea");
    return Model::open(folder / "plates.lbea");
  }
};

std::vector<Point> random_points(std::size_t count) {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> uniform(0, 100);
  std::vector<Point> points(count);
  for (Point& p : points) p = {uniform(random), uniform(random), uniform(random)};
  return points;
}

FrameTrial frame_of(double oracle_error, double fit_error, std::uint32_t fit_sample, std::uint32_t own,
                    Verdict verdict = Verdict::matched) {
  FrameTrial frame;
  frame.errors.fill(not_measured);
  frame.best.error = oracle_error;
  frame.errors[static_cast<std::size_t>(EvaluatedMethod::fit)] = fit_error;
  frame.samples[static_cast<std::size_t>(EvaluatedMethod::fit)] = fit_sample;
  frame.own = own;
  frame.verdict = verdict;
  return frame;
}

TestTrial test_of(std::vector<FrameTrial> frames) {
  TestTrial test;
  test.frames = std::move(frames);
  return test;
}

}  // namespace

TEST_CASE("splits are partitions that depend on the seed; both sides have a run") {
  for (const std::size_t runs : {2u, 3u, 10u, 40u})
    for (const double share : {0.01, 0.2, 0.5, 0.99}) {
      const Split split = random_split(runs, share, 1);
      check_partition(split, runs);
      CHECK(split.experiments.size() ==
            std::clamp<std::size_t>(static_cast<std::size_t>(std::lround(share * static_cast<double>(runs))), 1,
                                    runs - 1));
      CHECK(random_split(runs, share, 1).experiments == split.experiments);
    }
  CHECK(random_split(40, 0.5, 1).experiments != random_split(40, 0.5, 2).experiments);
  // Every run is chosen about equally often: 200 draws of 2 in 10; 5 standard deviations of a binomial with p = 0.2
  // are 28.
  std::vector<int> chosen(10);
  for (std::uint64_t seed = 0; seed < 200; ++seed)
    for (const std::size_t run : random_split(10, 0.2, seed).experiments) ++chosen[run];
  for (const int count : chosen) CHECK(std::abs(count - 40) < 29);
  for (const double share : {0.0, 1.0, -1.0, double(NAN)}) CHECK_THROWS_AS((void)random_split(10, share, 1), Error);
  CHECK_THROWS_AS((void)random_split(1, 0.5, 1), Error);
}

TEST_CASE("named and leave-one-out splits") {
  const auto runs = runs_named({"a", "b", "c"});
  const Split split = named_split(runs, std::vector<std::string>{"c", "a", "c"});
  check_partition(split, 3);
  CHECK(split.experiments == std::vector<std::size_t>{0, 2});
  CHECK_THROWS_AS((void)named_split(runs, std::vector<std::string>{"d"}), Error);
  CHECK_THROWS_AS((void)named_split(runs, std::vector<std::string>{"a", "b", "c"}), Error);
  const auto splits = leave_one_out(3);
  CHECK(splits.size() == 3);
  for (std::size_t i = 0; i < 3; ++i) {
    check_partition(splits[i], 3);
    CHECK(splits[i].experiments == std::vector<std::size_t>{i});
  }
  CHECK_THROWS_AS((void)leave_one_out(1), Error);
}

TEST_CASE("a subset keeps the reference run if it is in the subset") {
  const Ensemble all{runs_named({"a", "b", "c"}), {"p"}, 2};
  const std::vector<std::size_t> with{1, 2}, without{0, 1};
  CHECK(subset(all, with).reference_run == 1);
  CHECK(subset(all, with).runs[1].name == "c");
  CHECK(subset(all, without).reference_run == 0);
  CHECK(subset(all, without).parameter_names == all.parameter_names);
}

TEST_CASE("means and medians leave out what was not measured") {
  CHECK(std::isnan(mean({})));
  CHECK(std::isnan(median({})));
  CHECK(std::isnan(median(std::vector{not_measured})));
  CHECK(mean(std::vector{1.0, not_measured, 3.0}) == 2);
  CHECK(median(std::vector{5.0, not_measured, 1.0, 3.0}) == 3);
  CHECK(median(std::vector{4.0, 1.0, 2.0, 10.0}) == 3);
}

TEST_CASE("errors are averaged over time first, then over tests") {
  // Test 1: oracle 1, fit 2 and 4 -> 3. Test 2: one frame, oracle 3, fit 9. The ratio is (3 + 9) / (1 + 3) = 3.
  const std::vector<TestTrial> tests{test_of({frame_of(1, 2, 0, 5), frame_of(1, 4, 0, 5)}),
                                     test_of({frame_of(3, 9, 0, 5, Verdict::no_simulation_fits)})};
  const Summary summary = summarize(tests);
  const Score& fit = summary.scores[static_cast<std::size_t>(EvaluatedMethod::fit)];
  CHECK(summary.tests == 2);
  CHECK(summary.frames == 3);
  CHECK(summary.oracle.mean == 2);
  CHECK(fit.mean == 6);
  CHECK(fit.median == 6);
  CHECK(fit.ratio == 3);
  CHECK(std::isnan(fit.exact));  // none is contained
  CHECK(std::isnan(summary.named));
  CHECK(std::isnan(summary.scores[static_cast<std::size_t>(EvaluatedMethod::icp)].mean));
  CHECK(summary.verdicts[static_cast<std::size_t>(Verdict::matched)] == doctest::Approx(2.0 / 3));
  CHECK(summary.verdicts[static_cast<std::size_t>(Verdict::no_simulation_fits)] == doctest::Approx(1.0 / 3));
  CHECK(summarize({}).frames == 0);
}

TEST_CASE("folds are scored alone; their mean and the worst follow") {
  std::vector<TestTrial> tests{test_of({frame_of(1, 2, 0, 5)}), test_of({frame_of(3, 4, 0, 5), frame_of(3, 8, 0, 5)}),
                               test_of({frame_of(2, 2, 0, 5)})};
  CHECK(fold_rows(tests).empty());  // one split
  for (std::uint32_t i = 0; i < 3; ++i) tests[i].fold = i + 1;
  CHECK(fold_rows(tests).empty());  // each left out once
  tests[1].fold = 1;
  const auto rows = fold_rows(tests);
  REQUIRE(rows.size() == 4);
  const auto fit =
      static_cast<std::size_t>(std::ranges::find(tabulated_methods, EvaluatedMethod::fit) - tabulated_methods.begin());
  const std::vector<FoldRow> expected{{"1", 2, {}}, {"3", 1, {}}, {"mean", 3, {}}, {"worst", 3, {}}};
  const std::array ratios{(2.0 + 6.0) / (1 + 3), 1.0, 1.5, 2.0};
  for (std::size_t i = 0; i < rows.size(); ++i) {
    CHECK(rows[i].name == expected[i].name);
    CHECK(rows[i].tests == expected[i].tests);
    CHECK(rows[i].values[0] == 2);  // of the oracle
    CHECK(rows[i].values[fit + 1] == ratios[i]);
    CHECK(std::isnan(rows[i].values[1]));  // vtp was not measured
  }
}

TEST_CASE("the worst tests are those in which fit exceeds the oracle most") {
  Evaluation evaluation;
  CHECK(worst_tests(evaluation).empty());
  auto& tests = evaluation.rounds.emplace_back().tests;
  // Differences of the means: 1, 4, 2, none.
  tests = {test_of({frame_of(1, 2, 0, 5)}), test_of({frame_of(1, 1, 0, 5), frame_of(1, 9, 0, 5)}),
           test_of({frame_of(5, 7, 0, 5)}), test_of({frame_of(1, 1, 0, 5)})};
  for (std::size_t i = 0; i < 3; ++i) tests[i].worst.columns = 1;
  const auto worst = worst_tests(evaluation), two = worst_tests(evaluation, 2);
  REQUIRE(worst.size() == 3);
  CHECK(worst[0].test == &tests[1]);
  CHECK(worst[1].test == &tests[2]);
  CHECK(worst[2].test == &tests[0]);
  REQUIRE(two.size() == 2);
  CHECK(two[1].test == &tests[2]);
}

TEST_CASE("own samples are counted in contained experiments; an oracle of 0 has no ratio") {
  TestTrial test = test_of({frame_of(0, 0, 5, 5), frame_of(0, 1, 6, 7)});
  test.contained = true;
  test.experiment = test.named = "run";
  const Summary summary = summarize(std::vector{test});
  CHECK(summary.scores[static_cast<std::size_t>(EvaluatedMethod::fit)].exact == 0.5);
  CHECK(std::isnan(summary.scores[static_cast<std::size_t>(EvaluatedMethod::fit)].ratio));
  CHECK(summary.named == 1);
}

TEST_CASE("frames before two branches diverge are not counted") {
  TestTrial without =
      test_of({frame_of(1, 1, 0, 0), frame_of(5, 5, 0, 0, Verdict::no_simulation_fits), frame_of(5, 5, 0, 0)});
  TestTrial with = test_of({frame_of(1, 1, 0, 0), frame_of(1, 1, 0, 0), frame_of(1, 1, 0, 0)});
  for (std::uint32_t i = 0; i < 3; ++i) without.frames[i].step = with.frames[i].step = i;
  const DivergedFrames diverged = diverged_frames(std::vector{without}, std::vector{with});
  CHECK(diverged.frames == 2);
  CHECK(diverged.no_simulation_fits == 0.5);
  CHECK(diverged_frames({}, {}).frames == 0);
}

TEST_CASE("points are hidden in patches until the share is removed; the others are unchanged") {
  const auto points = random_points(5000);
  const auto rest = hide_patches(points, 0.3, 20, 7);
  CHECK(rest.size() == 3500);
  std::size_t at = 0;
  for (const Point& p : rest) {
    while (at < points.size() && (points[at].x != p.x || points[at].y != p.y || points[at].z != p.z)) ++at;
    REQUIRE(at < points.size());
  }
  CHECK(hide_patches(points, 0, 20, 7).size() == 5000);
  CHECK(hide_patches(points, 1, 20, 7).empty());
  CHECK(hide_patches({}, 0.3, 20, 7).empty());
  const auto again = hide_patches(points, 0.3, 20, 7);
  CHECK(std::ranges::equal(again, rest,
                           [](const Point& a, const Point& b) { return a.x == b.x && a.y == b.y && a.z == b.z; }));
}

TEST_CASE("a connected patch hides the points that are nearest to its place") {
  const auto points = random_points(5000);
  const auto rest = hide_nearest(points, 0.3, {10, 20, 30});
  CHECK(rest.size() == 3500);
  const auto distance = [](const Point& p) { return std::hypot(p.x - 10, p.y - 20, p.z - 30); };
  const float nearest = distance(*std::ranges::min_element(rest, {}, distance));
  CHECK(std::ranges::count_if(points, [&](const Point& p) { return distance(p) < nearest; }) == 1500);
  const Disturbance connected{.connected = 0.3};
  CHECK(disturbed(points, connected, 7, Point{10, 20, 30}).size() == 3500);
  CHECK(disturbed(points, connected, 7).size() == 3500);
  CHECK(disturbed({}, connected, 7).empty());
}

TEST_CASE("windows of stereo matching smear depth steps and lose edges") {
  bake::StereoSensor sensor;
  sensor.focal_px = 100, sensor.width_px = 60, sensor.height_px = 40;
  std::vector<Point> points;  // pixels 10 to 49 of all rows; a step of 100 behind column 30
  for (int row = 0; row < 40; ++row)
    for (int column = 10; column < 50; ++column) {
      const float z = column < 30 ? 500.0f : 600.0f, f = 100;
      points.push_back({(static_cast<float>(column) - 29.5f) / f * z, (static_cast<float>(row) - 19.5f) / f * z, z});
    }
  std::size_t in_middle = 0;
  for (const Point& p : smeared(points, sensor, 5)) {
    const auto column = static_cast<int>(std::floor(100 * p.x / p.z + 30)),
               row = static_cast<int>(std::floor(100 * p.y / p.z + 20));
    if (row != 20) continue;
    ++in_middle;
    CHECK(column >= 11);  // a window with its middle at 10 has three of its five columns
    CHECK(column <= 48);
    const int behind = std::clamp(column + 3 - 30, 0, 5);  // columns of the window
    CHECK(p.z == doctest::Approx(500 + 20 * behind));
  }
  CHECK(in_middle == 38);
  CHECK(smeared({}, sensor, 5).empty());
}

TEST_CASE("in folds every run is an experiment once") {
  const auto splits = folds(7, 3, 5);
  REQUIRE(splits.size() == 3);
  std::vector<std::size_t> experiments;
  for (const Split& split : splits) {
    CHECK(split.simulations.size() + split.experiments.size() == 7);
    experiments.insert(experiments.end(), split.experiments.begin(), split.experiments.end());
  }
  std::ranges::sort(experiments);
  CHECK(experiments == std::vector<std::size_t>{0, 1, 2, 3, 4, 5, 6});
  CHECK_THROWS_AS((void)folds(7, 8, 5), Error);
  CHECK_THROWS_AS((void)folds(7, 1, 5), Error);
}

TEST_CASE("thinning keeps a random share") {
  const auto points = random_points(9000);
  // Binomial with p = 1/3: standard deviation 45.
  CHECK(std::abs(static_cast<double>(thin(points, 1.0 / 3, 3).size()) - 3000) < 5 * 45);
  CHECK(thin(points, 1, 3).size() == 9000);
  CHECK(thin(points, 0, 3).empty());
}

TEST_CASE("a pose error turns about the center by the given angle and shifts by the given length") {
  const RigidTransform T{0, -1, 0, 10, 1, 0, 0, 20, 0, 0, 1, 30};  // reference x = 10 - y, y = 20 + x
  const Point center{50, 60, 70}, at_center{40, -40, 40};
  const Disturbance error{.pose_error_deg = 3, .pose_error = 5};
  const auto distance = [](const Point& a, const Point& b) { return std::hypot(a.x - b.x, a.y - b.y, a.z - b.z); };
  const std::vector<Point> before{at_center, {140, -40, 40}, {40, 60, 40}, {40, -40, 140}};
  for (const double share : {0.5, 1.0}) {
    const auto after = misplaced(before, error, share, T, center, 9);
    CHECK(distance(after[0], at_center) == doctest::Approx(5 * share).epsilon(1e-4));
    // The trace of the rotation, from the images of the axes, is 1 + 2 cos(angle).
    const float trace = (after[1].x - after[0].x + after[2].y - after[0].y + after[3].z - after[0].z) / 100;
    CHECK(std::acos((trace - 1) / 2) * 57.29578f == doctest::Approx(3 * share).epsilon(2e-3));
    const PoseError left = left_over(identity_transform, error, share, center, 9);
    CHECK(left.turn_deg == doctest::Approx(3 * share));
    CHECK(left.shift == doctest::Approx(5 * share));
  }
}

TEST_CASE("samples without a number at an element do not count; with half of the weight, none is the result") {
  const std::vector<float> a{1, NAN, NAN, 1}, b{3, 3, NAN, NAN}, c{5, 5, 4, 4};
  const std::vector<WeightedRow> rows{{a, 0.5f}, {b, 0.25f}, {c, 0.25f}};
  std::vector<float> m, spread;
  weighted_mean(rows, m);
  CHECK(m[0] == 2.5f);
  CHECK(std::isnan(m[1]));  // exactly half is not more than half of it
  CHECK(std::isnan(m[2]));
  CHECK(m[3] == 2);  // (0.5 * 1 + 0.25 * 4) / 0.75
  weighted_spread(rows, m, 1, spread);
  CHECK(std::isnan(spread[2]));
  CHECK(spread[3] == doctest::Approx(std::sqrt((0.5 * 1 + 0.25 * 4) / 0.75)));
  Inferred inferred;
  infer(std::vector<WeightedRow>{{a, -0.25f}, {b, 0.75f}, {c, 0.5f}}, rows, 1, inferred);
  CHECK(inferred.mean[1] == doctest::Approx((0.75 * 3 + 0.5 * 5) / 1.25));
  CHECK(inferred.spread[1] == doctest::Approx(std::sqrt((0.8 * 0.8 + 1.2 * 1.2) / 2)));
}

TEST_CASE("the signs of a regression's weights do not decide whether an element is eroded") {
  const std::vector<float> a{NAN, 1, 1, 1}, b{3, NAN, 3, 3}, c{4, 4, NAN, 4};
  const std::vector<WeightedRow> rows{{a, 0.55f}, {b, 0.9f}, {c, -0.45f}}, plausible{{a, 0.2f}, {b, 0.4f}, {c, 0.4f}};
  std::vector<float> m;
  weighted_mean(rows, m);
  // The missing value as the mean of the others by the amounts of their weights.
  CHECK(m[0] == doctest::Approx(0.55 * (0.9 * 3 + 0.45 * 4) / 1.35 + 0.9 * 3 - 0.45 * 4));
  CHECK(m[1] == doctest::Approx(0.55 * 1 + 0.9 * (0.55 * 1 + 0.45 * 4) / 1.0 - 0.45 * 4));
  CHECK(m[2] == doctest::Approx(0.55 * 1 + 0.9 * 3 - 0.45 * (0.55 * 1 + 0.9 * 3) / 1.45));
  weighted_mean(std::vector<WeightedRow>{{a, 1.5f}, {b, -1.0f}, {c, 0.5f}}, m);
  CHECK(std::isnan(m[0]));  // exactly half of the amounts
  Inferred inferred;
  infer(rows, plausible, 1, inferred);
  for (std::size_t i = 0; i < 4; ++i) CHECK(std::isfinite(inferred.mean[i]) == std::isfinite(inferred.spread[i]));
  CHECK(std::isfinite(inferred.mean[0]));
}

TEST_CASE("an inferred element has a mean and a spread, or neither") {
  const std::vector<float> a{1, NAN, NAN}, b{3, 3, NAN}, c{5, NAN, 5};
  const std::vector<WeightedRow> b_and_c{{b, 0.75f}, {c, 0.25f}}, most_a{{a, 0.875f}, {b, 0.125f}}, only_a{{a, 1.0f}};
  Inferred inferred;
  infer(b_and_c, most_a, 1, inferred);
  CHECK(inferred.mean[1] == 3);
  CHECK(inferred.spread[1] == 0);  // of the plausible samples that have the element
  CHECK(std::isnan(inferred.mean[2]));
  CHECK(std::isnan(inferred.spread[2]));
  infer(b_and_c, only_a, 1, inferred);
  CHECK(std::isnan(inferred.mean[1]));
  CHECK(std::isnan(inferred.spread[1]));
  CHECK(inferred.mean[0] == 3.5f);
}

TEST_CASE("weighted mean and spread by their formulas") {
  const std::vector<float> a{1, 2, 3, 4, 5, 6}, b{3, 2, 1, 0, 5, 10};
  const std::vector<WeightedRow> rows{{a, 0.25f}, {b, 0.75f}};
  std::vector<float> m, spread;
  weighted_mean(rows, m);
  CHECK(m == std::vector<float>{2.5f, 2, 1.5f, 1, 5, 9});
  weighted_spread(rows, m, 1, spread);
  // Two values with weights w and 1 - w: |difference| sqrt(w (1 - w)).
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(spread[i] == doctest::Approx(std::abs(a[i] - b[i]) * std::sqrt(0.25f * 0.75f)));
  weighted_spread(rows, m, 3, spread);
  CHECK(spread.size() == 2);
  CHECK(spread[0] == doctest::Approx(std::hypot(2.0, 0.0, 2.0) * std::sqrt(0.1875)));
  weighted_mean({}, m);
  CHECK(m.empty());
  weighted_spread({}, a, 1, spread);
  CHECK(spread == std::vector<float>(6, 0.0f));
  // About another value than the mean: never smaller.
  weighted_spread(rows, a, 1, spread);
  CHECK(spread[0] == doctest::Approx(2 * std::sqrt(0.75f)));
}

TEST_CASE("plausibilities sum to 1, decrease with the residual and ignore differences below the noise") {
  const Plates plates;
  const Model& model = plates.model;
  const std::vector<Match> candidates{{{0, 1}, 1.0f}, {{1, 2}, 1.0f}, {{2, 3}, 2.0f}};
  const auto weighted = plausible_samples(model, candidates, {.sharpness = 4, .noise = 1});
  CHECK(weighted[0].weight == weighted[1].weight);
  CHECK(weighted[2].weight / weighted[0].weight == doctest::Approx(std::exp(-4.0 * 3 / 2)));
  CHECK(weighted[0].weight + weighted[1].weight + weighted[2].weight == doctest::Approx(1));
  CHECK(weighted[2].sample == Sample{2, 3});
  CHECK(plausible_samples(model, {}).empty());
}

// Regression: a comma in the name of a run shifted the columns.
TEST_CASE("results.csv quotes names with commas and leaves cells without a value empty") {
  LiveRow row;
  row.result.frame_id = 7;
  row.result.matches.push_back({{0, 3}, "2.1 mm, steel", 0.003, 1.5f});
  row.error = 0.25;
  row.oracle_error = 0.125;
  LiveSummary summary;
  summary.rows.push_back(row);
  const TemporaryFolder folder;
  write_csv(folder / "results.csv", summary);
  const std::string text = text_of(folder / "results.csv");
  CAPTURE(text);
  CHECK(text.ends_with("\n7,0,ok,\"2.1 mm, steel\",3,1.5,0,0.25,0.125,0,0,unknown,unknown,,,,,,,,,,,,,,,\n"));
}

TEST_CASE("results.csv has a value and a bound per channel, in every frame under the same head") {
  LiveSummary summary;
  summary.rows.resize(3);  // the first frame was refused
  summary.rows[1].result.channels = {{{12.5f, 0.5f}, "end, \"x\"", "mm"}, {{-3, std::nanf("")}, "gap", ""}};
  summary.rows[2].result.channels = {{{4, 1}, "gap", ""}, {{7, 2}, "new", "m/s"}};
  const TemporaryFolder folder;
  write_csv(folder / "results.csv", summary);
  std::istringstream lines(text_of(folder / "results.csv"));
  std::array<std::string, 4> text;
  for (std::string& line : text) std::getline(lines, line);
  CHECK_MESSAGE(text[0].ends_with(",\"end, \"\"x\"\" [mm]\",\"end, \"\"x\"\" bound_90 [mm]\",gap,gap bound_90,"
                                  "new [m/s],new bound_90 [m/s]"),
                text[0]);
  CHECK(text[1].ends_with(",,,,,,"));
  CHECK(text[2].ends_with(",12.5,0.5,-3,,,"));
  CHECK(text[3].ends_with(",,,4,1,7,2"));
}

TEST_CASE("nodes of a run with the model's node numbers are found by number, those of a finer mesh by position") {
  const Plates plates;
  const Model& model = plates.model;
  const SimulationMesh same = plate_mesh();
  const TrueMesh by_number(same, model, {});
  CHECK(by_number.same_mesh());
  std::vector<float> positions;
  by_number.positions(same.positions, positions);
  CHECK(std::ranges::equal(positions, same.positions));
  // Runs of components that move as a whole may begin at other places.
  SimulationMesh moved = same;
  for (std::size_t i = 0; i < moved.positions.size(); i += 3) moved.positions[i] += 60;
  CHECK(TrueMesh(moved, model, {}).same_mesh());
  // Twice as fine, with some equal node numbers: every node of the model lies on a node or an edge of it.
  PlateShape finer;
  finer.columns = 2 * finer.columns - 1;
  finer.rows = 2 * finer.rows - 1;
  const SimulationMesh fine = plate_mesh(finer);
  const TrueMesh by_place(fine, model, {});
  CHECK(!by_place.same_mesh());
  const SimulationState bent = bent_state(fine, 0, 1.0, double{finer.length}),
                        expected = bent_state(same, 0, 1.0, double{finer.length});
  by_place.positions(bent.positions, positions);
  for (std::size_t i = 0; i < positions.size(); ++i)
    CHECK(positions[i] == doctest::Approx(expected.positions[i]).epsilon(1e-4));
}

TEST_CASE("the error of an experiment is that of the nodes that its run still has; meshes show what is eroded") {
  const Plates plates;
  const Model& model = plates.model;
  const SimulationMesh mesh = plate_mesh();
  SimulationState state;
  eroding_plate(0.8, 2, 1).read(1, state);
  hide_free_nodes(mesh, state.alive, state.positions);
  std::vector<float> truth;
  TrueMesh(mesh, model, {}).positions(state.positions, truth);
  CHECK(std::ranges::count_if(truth, [](float x) { return std::isnan(x); }) == 3 * 9);
  std::vector<float> sample = bent_state(mesh, 0, 0.8, 190).positions;
  for (std::size_t i = 1; i < sample.size(); i += 3) sample[i] += 2;
  sample[3 * patch_nodes()[4] + 2] = -1000;  // where the run has nothing
  CHECK(experiment_error(truth, sample) == doctest::Approx(2));
  CHECK(present_in(model, {{model.sample(0), 1.0f}}).empty());  // no sample of this model lacks elements
}

TEST_CASE("VTU files flag eroded elements when samples of the model lack some") {
  const TemporaryFolder folder;
  bake_model(eroding_plates(1, 2, 1), bent_plates_description(), folder / "m.lbea");
  const Model model = Model::open(folder / "m.lbea");
  MeshSeries series(model, folder.path());
  series.add_match("whole", 1, 0);
  series.add_match("hole", 3, 0.0005);
  for (const auto& [file, eroded] : {std::pair{"matched_whole.vtu", 0}, {"matched_hole.vtu", 16}}) {
    SimulationState state;
    open_simulation(folder / file)->read(0, state);
    CHECK(std::ranges::count(state.alive, 0) == eroded);
  }
  CHECK(eroded_in(model, {{model.sample(3), 0.6f}, {model.sample(1), 0.4f}}).size() == 16);
  CHECK(eroded_in(model, {{model.sample(3), 0.4f}, {model.sample(1), 0.6f}}).empty());
}

TEST_CASE("experiments with other meshes have the part ids that the ensemble's table says") {
  const TemporaryFolder folder;
  const auto row = [](const char* x) { return std::string("[[1,0,0,") + x + "],[0,1,0,45],[0,0,1,-600]]"; };
  const auto rig = put(folder / "sensor.json", "{\"T_reference_sensor\":" + row("95") +
                                                   ",\"sensor\":{\"focal_px\":300,\"width_px\":140,\"height_px\":"
                                                   "80,\"T_reference_right\":" +
                                                   row("155") + "}}");
  const auto run_of = [](const std::string& name, const SimulationMesh& mesh, double angle) {
    std::vector<SimulationState> states;
    for (std::uint32_t step = 0; step < 3; ++step)
      states.push_back(bent_state(mesh, 0.0005 * step, angle * step / 2, 190));
    const SyntheticSimulation run(mesh, states, {{"plastic_strain", "1"}});
    return EnsembleRun{name, {}, [run] { return std::make_unique<SyntheticSimulation>(run); }};
  };
  constexpr PlateShape coarse{20, 10, 190, 90}, fine{39, 19, 190, 90};
  const SimulationMesh mesh = two_plates(coarse, {1, 2});
  EvaluationPlan plan;
  plan.description = bent_plates_description();
  plan.description.mapping.parts = {{1, 2}, {2, 1}};
  plan.description.depth_sensor = rig;
  plan.ensemble = {{run_of("a", mesh, 0.2), run_of("b", mesh, 0.4)}, {}, 0};
  plan.splits = {{{0, 1}, {}}};
  const EnsembleRun other = run_of("other", two_plates(fine, {2, 1}), 0.4);
  plan.more_experiments = {{other.name, other.open}};
  plan.contained = plan.other_components = plan.icp = false;
  plan.trial.sensor = read_sensor_json(rig);
  plan.scratch = folder.path();
  plan.threads = 1;
  const Evaluation evaluation = evaluate(plan, {[](auto, auto, auto) {}, [] { return false; }});
  REQUIRE(evaluation.rounds.size() == 1);
  REQUIRE(evaluation.rounds[0].tests.size() == 1);
  // Run b bends as much; the plate of the other part is 2 mm away.
  for (const FrameTrial& frame : evaluation.rounds[0].tests[0].frames) CHECK(frame.best.error < 0.01);
}

TEST_CASE("ICP finds the sample that the points are from, also from an inaccurate pose") {
  const Plates plates;
  const Model& model = plates.model;
  const IcpBaseline icp(model);
  for (const std::uint32_t sample : {model.samples() - 1, model.samples() / 2 + 2}) {
    std::vector<std::array<double, 3>> points;
    const auto positions = model.node_positions(sample);
    for (const std::uint32_t node : model.vertex_nodes(0)) {
      const float* p = &positions[3 * std::size_t{node}];
      points.push_back({double{p[0]} + 1.5, double{p[1]} - 1, double{p[2]} + 0.5});
    }
    CHECK(icp.match(points).sample == sample);
    CHECK(icp.match(points).mean_squared_error <= icp.align((sample + 1) % model.samples(), points));
  }
}
