#include "tools/eval/evaluation_report.hpp"

#include "tools/eval/channels/channel_tables.hpp"
#include "tools/eval/forecast/forecast_tables.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

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

// Shares of the verdicts on the test so far. The first frames of a test have none.
std::array<double, 4> verdicts_of_tests(std::span<const TestTrial> tests) {
  std::array<std::vector<double>, 4> is_verdict;
  for (const TestTrial& test : tests)
    for (const FrameTrial& frame : test.frames)
      for (std::size_t v = 0; v < is_verdict.size() && frame.test_verdict != Verdict::unknown; ++v)
        is_verdict[v].push_back(frame.test_verdict == static_cast<Verdict>(v) ? 1 : 0);
  return {mean(is_verdict[0]), mean(is_verdict[1]), mean(is_verdict[2]), mean(is_verdict[3])};
}

double exact_hits(std::span<const TestTrial> tests, std::size_t method) {
  std::vector<double> hits;
  for (const TestTrial& test : tests)
    for (const FrameTrial& frame : test.frames)
      if (test.contained && !std::isnan(frame.errors[method]))
        hits.push_back(frame.samples[method] == frame.own ? 1 : 0);
  return mean(hits);
}

Score score(std::span<const TestTrial> tests, std::size_t method, double oracle_mean) {
  const auto means = means_over_time(tests, [&](const FrameTrial& frame) { return frame.errors[method]; });
  Score score{mean(means), median(means), not_measured, not_measured};
  if (oracle_mean > 0) score.ratio = score.mean / oracle_mean;
  if (method != static_cast<std::size_t>(EvaluatedMethod::estimate)) score.exact = exact_hits(tests, method);
  return score;
}

std::string number(double value, int digits = 2) { return std::isnan(value) ? "-" : formatted("%.*f", digits, value); }
std::string percent(double value) { return std::isnan(value) ? "-" : formatted("%.1f %%", 100 * value); }

std::string mode_words(ReferenceMode mode) { return mode == ReferenceMode::impact ? "at impact" : "over time"; }

using Cells = std::vector<std::string>;

std::string name_of(EvaluatedMethod method) {
  return std::string(evaluated_method_names[static_cast<std::size_t>(method)]);
}

bool undisturbed(const Round& round) { return round.disturbance.name == Disturbance{}.name; }

std::string errors_table(const Round& round, const std::string& unit) {
  const Summary summary = summarize(round.tests);
  std::string text = formatted("### %s experiments, reference %s\n\n%zu tests, %zu frames.\n\n", round.title.c_str(),
                               mode_words(round.mode).c_str(), summary.tests, summary.frames);
  text += "| method | mean EE [" + unit + "] | median | ratio to the oracle | own sample |\n|---|---|---|---|---|\n";
  const auto row = [&](std::string_view name, const Score& score) {
    text += table_line(
        {std::string(name), number(score.mean, 3), number(score.median, 3), number(score.ratio), percent(score.exact)});
  };
  row("oracle", summary.oracle);
  for (std::size_t c = 0; c < evaluated_methods; ++c)
    if (!std::isnan(summary.scores[c].mean)) row(evaluated_method_names[c], summary.scores[c]);
  if (!std::isnan(summary.named))
    text += "\nThe tracker finds the own simulation at the end of " + percent(summary.named) + " of the tests.\n";
  return text + "\n";
}

std::string robustness_table(const Evaluation& evaluation, const std::string& title) {
  Cells columns{"frames", "oracle"};
  std::ranges::transform(tabulated_methods, std::back_inserter(columns), name_of);
  columns.insert(columns.end(), {"own sample (fit)", "own simulation (tracker)", "no simulation fits"});
  std::string text = table_head("Disturbed frames, " + title, columns);
  std::size_t rows = 0;
  for (const Round& round : evaluation.rounds) {
    if (round.title != title || round.mode != evaluation.rounds.front().mode) continue;
    const Summary s = summarize(round.tests);
    Cells cells{round.disturbance.name, number(s.oracle.mean)};
    for (const EvaluatedMethod c : tabulated_methods) {
      const Score& score = s.of(c);
      cells.push_back(number(score.mean) + (std::isnan(score.ratio) ? "" : " (" + number(score.ratio) + ")"));
    }
    cells.insert(cells.end(), {percent(s.of(EvaluatedMethod::fit).exact), percent(s.named),
                               percent(s.verdicts[static_cast<std::size_t>(Verdict::no_simulation_fits)])});
    text += table_line(cells);
    ++rows;
  }
  return rows < 2 ? "" : text + "\nMean EE, and its ratio to the oracle's.\n\n";
}

std::string fold_table(const Round& round) {
  const auto folds = fold_rows(round.tests);
  if (folds.empty()) return "";
  Cells columns{"fold", "tests", "oracle"};
  std::ranges::transform(tabulated_methods, std::back_inserter(columns), name_of);
  std::string text = table_head(
      "Folds, " + round.title + " experiments, reference " + mode_words(round.mode) + ", " + round.disturbance.name,
      columns);
  for (const FoldRow& fold : folds) {
    Cells cells{fold.name, std::to_string(fold.tests)};
    for (const double value : fold.values) cells.push_back(number(value));
    text += table_line(cells);
  }
  return text + "\nOracle: mean EE; methods: ratio to it. Worst: the greatest value of each column.\n\n";
}

std::string worst_table(const Evaluation& evaluation) {
  const auto tests = worst_tests(evaluation);
  if (tests.empty()) return "";
  std::string text = table_head("Worst tests, " + evaluation.rounds.front().title + " experiments",
                                {"experiment", "branch", "oracle", "fit", "estimate", "ratio", "worst step"});
  for (const auto& [test, s] : tests) {
    const Score& fit = s.of(EvaluatedMethod::fit);
    text +=
        table_line({test->experiment, std::to_string(test->branch), number(s.oracle.mean), number(fit.mean),
                    number(s.of(EvaluatedMethod::estimate).mean), number(fit.ratio), std::to_string(test->worst.step)});
  }
  return text +
         "\nMean EE; greatest difference between fit and oracle first. Ratio: fit to oracle. Worst step: of the "
         "frame in which they differ most; for its depth images see worst/ and the figures.\n\n";
}

std::string verdict_table(const Evaluation& evaluation) {
  std::string text =
      table_head("Verdicts, shares of the frames",
                 {"experiments", "frames", "matched", "ambiguous", "no simulation fits", "unknown", "after divergence",
                  "test: matched", "test: ambiguous", "test: no simulation fits", "test: after divergence"});
  for (const Round& round : evaluation.rounds) {
    if (!undisturbed(round) || round.mode != evaluation.rounds.front().mode) continue;
    const Summary s = summarize(round.tests);
    const auto share = [&](Verdict verdict) { return percent(s.verdicts[static_cast<std::size_t>(verdict)]); };
    const auto test_share = [&](Verdict verdict) {
      return percent(s.test_verdicts[static_cast<std::size_t>(verdict)]);
    };
    std::string diverged = "-", test_diverged = "-";
    const auto beside = std::ranges::find_if(evaluation.rounds, [&](const Round& other) {
      return round.title.ends_with(" removed") &&
             other.title == round.title.substr(0, round.title.size() - 7) + "present";
    });
    if (beside != evaluation.rounds.end()) {
      const DivergedFrames after = diverged_frames(round.tests, beside->tests);
      diverged = percent(after.no_simulation_fits) + formatted(" of %zu", after.frames);
      test_diverged = percent(after.test_no_simulation_fits);
    }
    text +=
        table_line({round.title, std::to_string(s.frames), share(Verdict::matched), share(Verdict::ambiguous),
                    share(Verdict::no_simulation_fits), share(Verdict::unknown), diverged, test_share(Verdict::matched),
                    test_share(Verdict::ambiguous), test_share(Verdict::no_simulation_fits), test_diverged});
  }
  return text +
         "\nTest: the verdict on the test so far, from its fourth frame on. After divergence: share of *no simulation "
         "fits* among the frames whose oracle error without the branch is more than twice that with it.\n\n";
}

std::string field_table(const Evaluation& evaluation) {
  std::string text =
      table_head("Inferred " + evaluation.field, {"experiments", "mean of the truth", "error of the match",
                                                  "of the estimate", "of the estimate in hidden elements"});
  std::size_t rows = 0;
  for (const Round& round : evaluation.rounds) {
    const FieldError field = summarize(round.tests).field;
    if (!undisturbed(round) || round.mode != evaluation.rounds.front().mode || std::isnan(field.true_mean)) continue;
    text += table_line({round.title, number(field.true_mean, 4), number(field.matched, 4), number(field.inferred, 4),
                        number(field.hidden, 4)});
    ++rows;
  }
  return rows == 0 ? "" : text + "\nMean absolute difference per element, over the whole component.\n\n";
}

std::string bound_table(const Evaluation& evaluation) {
  std::string text = table_head("90 % bounds: share of the truth within them, and their mean",
                                {"experiments", "frames", "estimate's mean error", "node positions", "field"});
  for (const Round& round : evaluation.rounds) {
    Cells cells{round.title, round.disturbance.name};
    for (const BoundCheck& check : summarize(round.tests).bounds)
      cells.push_back(std::isnan(check.within) ? "" : percent(check.within) + " (" + number(check.mean, 3) + ")");
    text += table_line(cells);
  }
  return text + "\nMeans over tests. Samples of which the own run is one are closer than the bounds say.\n\n";
}

std::string branch_table(const Evaluation& evaluation) {
  const Round& round = evaluation.rounds.front();
  Cells columns{"branch", "tests", "oracle"};
  columns.insert(columns.end(), evaluated_method_names.begin(), evaluated_method_names.end());
  std::string text = table_head("Deformation branches, " + round.title + " experiments", columns);
  for (std::uint32_t branch = 0; branch < evaluation.branches; ++branch) {
    std::vector<TestTrial> tests;
    std::ranges::copy_if(round.tests, std::back_inserter(tests),
                         [&](const TestTrial& test) { return test.branch == branch; });
    if (tests.empty()) continue;
    const Summary s = summarize(tests);
    Cells cells{std::to_string(branch), std::to_string(s.tests), number(s.oracle.mean)};
    for (const Score& score : s.scores) cells.push_back(number(score.ratio));
    text += table_line(cells);
  }
  return text + "\nOracle: mean EE; methods: ratio to it. For errors over time see frames.csv and the figures.\n\n";
}

std::string time_table(const Evaluation& evaluation) {
  const auto median_seconds = [&](const auto& part) {
    std::vector<double> seconds;
    for (const bake::BakeSummary& bake : evaluation.bakes) seconds.push_back(bake.seconds.*part);
    return number(median(seconds));
  };
  using Seconds = decltype(bake::BakeSummary::seconds);
  std::string text = "### Time\n\n| preprocessing (" + std::to_string(evaluation.bakes.size()) +
                     " bakes) | seconds, median |\n|---|---|\n";
  text += "| reading | " + median_seconds(&Seconds::reading) + " |\n| bases | " + median_seconds(&Seconds::bases) +
          " |\n| samples: correspondence, coefficients, depth images | " + median_seconds(&Seconds::samples) +
          " |\n| calibrating, writing | " + median_seconds(&Seconds::writing) + " |\n\n";
  const auto stage = [&](const auto& value) {
    std::vector<double> values;
    for (const TestTrial& test : evaluation.rounds.front().tests)
      for (const FrameTrial& frame : test.frames) values.push_back(static_cast<double>(value(frame)));
    return median(values);
  };
  const double points = stage([](const FrameTrial& f) { return f.points; });
  text += "| matching of a frame of " + number(points, 0) + " points | ms, median |\n|---|---|\n";
  const auto row = [&](const char* name, double value) { text += table_line({name, number(value, 3)}); };
  row("index of the cloud", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.index; }));
  row("correspondence", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.correspondence; }));
  row("projection", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.projection; }));
  row("search, VtP", 1e-6 * stage([](const FrameTrial& f) { return f.vtp_ns.matching; }));
  row("search, LBEA", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.matching; }));
  row("fit: depth images and estimate", 1e-6 * stage([](const FrameTrial& f) { return f.fit_ns.fit; }));
  row("coverage", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.coverage; }));
  row("ICP, total", 1e3 * stage([](const FrameTrial& f) { return f.icp_s; }));
  return text + "\n";
}

}  // namespace

std::string table_line(const std::vector<std::string>& cells) {
  std::string text = "|";
  for (const std::string& cell : cells) text += " " + cell + " |";
  return text + "\n";
}

std::string table_head(const std::string& title, const std::vector<std::string>& columns) {
  std::string text = "### " + title + "\n\n" + table_line(columns) + "|";
  for (std::size_t i = 0; i < columns.size(); ++i) text += "---|";
  return text + "\n";
}

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

Summary summarize(std::span<const TestTrial> tests) {
  Summary summary;
  summary.tests = tests.size();
  std::vector<double> named;
  for (const TestTrial& test : tests) {
    if (test.contained) named.push_back(test.named == test.experiment ? 1 : 0);
    for (const FrameTrial& frame : test.frames) {
      ++summary.frames;
      summary.verdicts[static_cast<std::size_t>(frame.verdict)] += 1;
    }
  }
  for (double& share : summary.verdicts) share /= static_cast<double>(std::max<std::size_t>(summary.frames, 1));
  summary.test_verdicts = verdicts_of_tests(tests);
  summary.named = mean(named);
  const auto best = means_over_time(tests, [](const FrameTrial& frame) { return frame.best.error; });
  summary.oracle = {mean(best), median(best), mean(best) > 0 ? 1 : not_measured, not_measured};
  for (std::size_t c = 0; c < evaluated_methods; ++c) summary.scores[c] = score(tests, c, summary.oracle.mean);
  for (const auto& [name, value] : field_errors)
    summary.field.*value = overall(tests, [value = value](const FrameTrial& frame) { return frame.field.*value; });
  for (std::size_t b = 0; b < summary.bounds.size(); ++b)
    summary.bounds[b] = {overall(tests, [b](const FrameTrial& frame) { return frame.bounds[b].within; }),
                         overall(tests, [b](const FrameTrial& frame) { return frame.bounds[b].mean; })};
  return summary;
}

std::vector<FoldRow> fold_rows(std::span<const TestTrial> tests) {
  std::map<std::uint32_t, std::vector<TestTrial>> folds;
  for (const TestTrial& test : tests)
    if (test.fold > 0) folds[test.fold].push_back(test);
  std::vector<FoldRow> rows;
  if (folds.size() < 2 || folds.size() == tests.size()) return rows;
  for (const auto& [fold, tested] : folds) {
    const Summary s = summarize(tested);
    FoldRow& row = rows.emplace_back(FoldRow{std::to_string(fold), s.tests, {s.oracle.mean}});
    std::ranges::transform(tabulated_methods, row.values.begin() + 1, [&](auto method) { return s.of(method).ratio; });
  }
  FoldRow average{"mean", tests.size(), {}}, worst{"worst", tests.size(), {}};
  for (std::size_t c = 0; c < average.values.size(); ++c) {
    std::vector<double> values;
    for (const FoldRow& row : rows) values.push_back(row.values[c]);
    average.values[c] = mean(values);
    worst.values[c] =
        std::accumulate(values.begin(), values.end(), not_measured, [](double x, double y) { return std::fmax(x, y); });
  }
  rows.insert(rows.end(), {average, worst});
  return rows;
}

std::vector<WorstTest> worst_tests(const Evaluation& evaluation, std::size_t most) {
  std::vector<WorstTest> worst;
  if (evaluation.rounds.empty()) return worst;
  for (const TestTrial& test : evaluation.rounds.front().tests)
    if (test.worst.columns > 0) worst.push_back({&test, summarize(std::span(&test, 1))});
  const auto difference = [](const WorstTest& w) {
    return w.summary.of(EvaluatedMethod::fit).mean - w.summary.oracle.mean;
  };
  std::erase_if(worst, [&](const WorstTest& w) { return !(difference(w) > 0); });
  std::ranges::stable_sort(worst, std::greater{}, difference);
  worst.resize(std::min(worst.size(), most));
  return worst;
}

DivergedFrames diverged_frames(std::span<const TestTrial> without, std::span<const TestTrial> with) {
  DivergedFrames diverged;
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
  diverged.frames = refused.size();
  diverged.no_simulation_fits = mean(refused);
  diverged.test_no_simulation_fits = mean(refused_by_test);
  return diverged;
}

std::string tables(const Evaluation& evaluation) {
  if (evaluation.rounds.empty() || evaluation.rounds.front().tests.empty()) return "";
  std::string text;
  for (const Round& round : evaluation.rounds)
    if (undisturbed(round) && (round.title == "unseen" || round.title == "contained"))
      text += errors_table(round, evaluation.length_unit);
  for (const Round& round : evaluation.rounds) text += fold_table(round);
  text += worst_table(evaluation) + branch_table(evaluation);
  for (const char* title : {"unseen", "contained"}) text += robustness_table(evaluation, title);
  return text + verdict_table(evaluation) + bound_table(evaluation) + field_table(evaluation) +
         forecast_tables(evaluation) + channel_tables(evaluation) + time_table(evaluation);
}

}  // namespace lbea::tool
