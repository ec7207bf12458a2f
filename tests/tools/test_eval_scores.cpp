// Splits of the ensemble and scores of the evaluation, by their definitions.
#include "tools/eval/evaluation.hpp"
#include "tools/eval/evaluation_report.hpp"
#include "tools/eval/experiments.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numeric>

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
