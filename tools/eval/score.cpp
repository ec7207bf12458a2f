#include "tools/eval/score.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

std::vector<double> known(std::span<const double> values) {
  std::vector<double> kept;
  std::ranges::copy_if(values, std::back_inserter(kept), [](double v) { return !std::isnan(v); });
  return kept;
}

template <class Value>
std::vector<double> means_over_time(std::span<const TestTrial> tests, const Value& value) {
  std::vector<double> means;
  for (const TestTrial& test : tests) {
    std::vector<double> values;
    for (const FrameTrial& frame : test.frames) values.push_back(value(frame));
    means.push_back(mean(values));
  }
  return means;
}

template <class Value>
double overall(std::span<const TestTrial> tests, const Value& value) {
  return mean(means_over_time(tests, value));
}

// A test's first frames have none yet.
std::array<double, 4> verdicts_of_tests(std::span<const TestTrial> tests) {
  std::array<std::vector<double>, 4> said;
  for (const TestTrial& test : tests)
    for (const FrameTrial& frame : test.frames)
      for (std::size_t v = 0; v < said.size() && frame.test_verdict != Verdict::unknown; ++v)
        said[v].push_back(frame.test_verdict == static_cast<Verdict>(v) ? 1 : 0);
  return {mean(said[0]), mean(said[1]), mean(said[2]), mean(said[3])};
}

double exact_hits(std::span<const TestTrial> tests, std::size_t contender) {
  std::vector<double> hits;
  for (const TestTrial& test : tests)
    for (const FrameTrial& frame : test.frames)
      if (test.contained && !std::isnan(frame.errors[contender]))
        hits.push_back(frame.samples[contender] == frame.own ? 1 : 0);
  return mean(hits);
}

Score score(std::span<const TestTrial> tests, std::size_t contender, double oracle_mean) {
  const auto means = means_over_time(tests, [&](const FrameTrial& frame) { return frame.errors[contender]; });
  Score score{mean(means), median(means), not_measured, not_measured};
  if (oracle_mean > 0) score.ratio = score.mean / oracle_mean;
  if (contender != static_cast<std::size_t>(Contender::estimate)) score.exact = exact_hits(tests, contender);
  return score;
}

}  // namespace

double mean(std::span<const double> values) {
  const auto kept = known(values);
  double sum = 0;
  for (const double value : kept) sum += value;
  return kept.empty() ? not_measured : sum / static_cast<double>(kept.size());
}

double median(std::span<const double> values) {
  auto kept = known(values);
  if (kept.empty()) return not_measured;
  std::ranges::sort(kept);
  const std::size_t half = kept.size() / 2;
  return kept.size() % 2 == 1 ? kept[half] : 0.5 * (kept[half - 1] + kept[half]);
}

Summary summarise(std::span<const TestTrial> tests) {
  Summary summary;
  summary.tests = tests.size();
  std::vector<double> named, covered;
  for (const TestTrial& test : tests) {
    if (test.contained) named.push_back(test.named == test.experiment ? 1 : 0);
    for (const FrameTrial& frame : test.frames) {
      ++summary.frames;
      summary.verdicts[static_cast<std::size_t>(frame.verdict)] += 1;
      covered.push_back(frame.status == Status::ok ? 0 : 1);
    }
  }
  for (double& share : summary.verdicts) share /= static_cast<double>(std::max<std::size_t>(summary.frames, 1));
  summary.test_verdicts = verdicts_of_tests(tests);
  summary.named = mean(named);
  summary.low_coverage = mean(covered);
  const auto best = means_over_time(tests, [](const FrameTrial& frame) { return frame.best.error; });
  summary.oracle = {mean(best), median(best), mean(best) > 0 ? 1 : not_measured, not_measured};
  for (std::size_t c = 0; c < contenders; ++c) summary.scores[c] = score(tests, c, summary.oracle.mean);
  summary.field = {overall(tests, [](const FrameTrial& f) { return f.field.true_mean; }),
                   overall(tests, [](const FrameTrial& f) { return f.field.matched; }),
                   overall(tests, [](const FrameTrial& f) { return f.field.inferred; }),
                   overall(tests, [](const FrameTrial& f) { return f.field.hidden; }),
                   overall(tests, [](const FrameTrial& f) { return f.field.within_spread; })};
  return summary;
}

Parted parted_frames(std::span<const TestTrial> without, std::span<const TestTrial> with) {
  Parted parted;
  std::vector<double> refused, refused_by_test;
  for (const TestTrial& test : without) {
    const auto same = std::ranges::find(with, test.experiment, &TestTrial::experiment);
    if (same == with.end()) continue;
    for (const FrameTrial& frame : test.frames) {
      const auto beside = std::ranges::find(same->frames, frame.step, &FrameTrial::step);
      if (beside == same->frames.end() || frame.best.error <= 2 * beside->best.error) continue;
      refused.push_back(frame.verdict == Verdict::no_simulation_fits ? 1 : 0);
      if (frame.test_verdict != Verdict::unknown)
        refused_by_test.push_back(frame.test_verdict == Verdict::no_simulation_fits ? 1 : 0);
    }
  }
  parted.frames = refused.size();
  parted.no_simulation_fits = mean(refused);
  parted.test_says_so = mean(refused_by_test);
  return parted;
}

}  // namespace lbea::tool
