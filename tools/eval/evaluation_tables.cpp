#include "tools/eval/evaluation_report.hpp"
#include "tools/eval/report_text.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lbea::tool {
namespace {

std::string number(double value, int digits = 2) { return std::isnan(value) ? "-" : formatted("%.*f", digits, value); }
std::string percent(double value) { return std::isnan(value) ? "-" : formatted("%.1f %%", 100 * value); }

std::string mode_words(ReferenceMode mode) { return mode == ReferenceMode::impact ? "at impact" : "over time"; }

bool undisturbed(const Round& round) { return round.disturbance.name == Disturbance{}.name; }

std::string errors_table(const Round& round, const std::string& unit) {
  const Summary summary = summarise(round.tests);
  std::string text = formatted("### %s experiments, reference %s\n\n%zu tests, %zu frames.\n\n", round.title.c_str(),
                               mode_words(round.mode).c_str(), summary.tests, summary.frames);
  text += "| method | mean EE [" + unit + "] | median | ratio to the oracle | own sample |\n|---|---|---|---|---|\n";
  const auto row = [&](std::string_view name, const Score& score) {
    text += "| " + std::string(name) + " | " + number(score.mean, 3) + " | " + number(score.median, 3) + " | " +
            number(score.ratio) + " | " + percent(score.exact) + " |\n";
  };
  row("oracle", summary.oracle);
  for (std::size_t c = 0; c < contenders; ++c)
    if (!std::isnan(summary.scores[c].mean)) row(contender_names[c], summary.scores[c]);
  if (!std::isnan(summary.named))
    text += "\nThe tracker names the own simulation at the end of " + percent(summary.named) + " of the tests.\n";
  return text + "\n";
}

std::string robustness_table(const Evaluation& evaluation, const std::string& title) {
  constexpr std::array shown{Contender::vtp,      Contender::lbea,    Contender::look_alike, Contender::fit,
                             Contender::estimate, Contender::tracked, Contender::path};
  std::string text = "### Disturbed frames, " + title + "\n\n| frames | oracle |";
  for (const Contender c : shown) text += " " + std::string(contender_names[static_cast<std::size_t>(c)]) + " |";
  text += " own sample (fit) | own simulation (tracker) | no simulation fits |\n|---|---|";
  for (std::size_t i = 0; i < shown.size(); ++i) text += "---|";
  text += "---|---|---|\n";
  std::size_t rows = 0;
  for (const Round& round : evaluation.rounds) {
    if (round.title != title || round.mode != evaluation.rounds.front().mode) continue;
    const Summary s = summarise(round.tests);
    text += "| " + round.disturbance.name + " | " + number(s.oracle.mean) + " |";
    for (const Contender c : shown) {
      const Score& score = s.scores[static_cast<std::size_t>(c)];
      text += " " + number(score.mean) + (std::isnan(score.ratio) ? "" : " (" + number(score.ratio) + ")") + " |";
    }
    text += " " + percent(s.scores[static_cast<std::size_t>(Contender::fit)].exact) + " | " + percent(s.named) + " | " +
            percent(s.verdicts[static_cast<std::size_t>(Verdict::no_simulation_fits)]) + " |\n";
    ++rows;
  }
  return rows < 2 ? "" : text + "\nMean EE, and its ratio to the oracle's.\n\n";
}

std::string verdict_table(const Evaluation& evaluation) {
  std::string text =
      "### Verdicts, shares of the frames\n\n| experiments | frames | matched | ambiguous | no simulation fits | "
      "unknown | after parting | test: matched | test: ambiguous | test: no simulation fits | test: after parting "
      "|\n|---|---|---|---|---|---|---|---|---|---|---|\n";
  for (const Round& round : evaluation.rounds) {
    if (!undisturbed(round) || round.mode != evaluation.rounds.front().mode) continue;
    const Summary s = summarise(round.tests);
    const auto share = [&](Verdict verdict) { return percent(s.verdicts[static_cast<std::size_t>(verdict)]); };
    const auto test_share = [&](Verdict verdict) {
      return percent(s.test_verdicts[static_cast<std::size_t>(verdict)]);
    };
    std::string parted = "-", test_parted = "-";
    const auto beside = std::ranges::find_if(evaluation.rounds, [&](const Round& other) {
      return round.title.ends_with(" removed") &&
             other.title == round.title.substr(0, round.title.size() - 7) + "present";
    });
    if (beside != evaluation.rounds.end()) {
      const Parted after = parted_frames(round.tests, beside->tests);
      parted = percent(after.no_simulation_fits) + formatted(" of %zu", after.frames);
      test_parted = percent(after.test_says_so);
    }
    text += "| " + round.title + formatted(" | %zu | ", s.frames) + share(Verdict::matched) + " | " +
            share(Verdict::ambiguous) + " | " + share(Verdict::no_simulation_fits) + " | " + share(Verdict::unknown) +
            " | " + parted + " | " + test_share(Verdict::matched) + " | " + test_share(Verdict::ambiguous) + " | " +
            test_share(Verdict::no_simulation_fits) + " | " + test_parted + " |\n";
  }
  return text +
         "\nTest: the verdict on the test so far, from its fourth frame on. After parting: *no simulation fits* among "
         "the frames in which the oracle without the branch is more than twice as far off as with it.\n\n";
}

std::string field_table(const Evaluation& evaluation) {
  std::string text = "### Inferred " + evaluation.field +
                     "\n\n| experiments | mean of the truth | error of the match | of the estimate | of the estimate "
                     "where hidden | within two spreads |\n|---|---|---|---|---|---|\n";
  std::size_t rows = 0;
  for (const Round& round : evaluation.rounds) {
    const FieldError field = summarise(round.tests).field;
    if (!undisturbed(round) || round.mode != evaluation.rounds.front().mode || std::isnan(field.true_mean)) continue;
    text += "| " + round.title + " | " + number(field.true_mean, 4) + " | " + number(field.matched, 4) + " | " +
            number(field.inferred, 4) + " | " + number(field.hidden, 4) + " | " + percent(field.within_spread) + " |\n";
    ++rows;
  }
  return rows == 0 ? "" : text + "\nMean absolute difference per element, over the whole component.\n\n";
}

std::string branch_table(const Evaluation& evaluation) {
  const Round& round = evaluation.rounds.front();
  std::string text = "### Deformation branches, " + round.title + " experiments\n\n| branch | tests | oracle |";
  for (std::size_t c = 0; c < contenders; ++c) text += " " + std::string(contender_names[c]) + " |";
  text += "\n|---|---|---|";
  for (std::size_t c = 0; c < contenders; ++c) text += "---|";
  text += "\n";
  for (std::uint32_t branch = 0; branch < evaluation.branches; ++branch) {
    std::vector<TestTrial> tests;
    std::ranges::copy_if(round.tests, std::back_inserter(tests),
                         [&](const TestTrial& test) { return test.branch == branch; });
    if (tests.empty()) continue;
    const Summary s = summarise(tests);
    text += formatted("| %u | %zu | ", branch, s.tests) + number(s.oracle.mean) + " |";
    for (const Score& score : s.scores) text += " " + number(score.ratio) + " |";
    text += "\n";
  }
  return text + "\nOracle: mean EE; methods: ratio to it. Over time: frames.csv and the figures.\n\n";
}

std::string time_table(const Evaluation& evaluation) {
  std::vector<double> reading, bases, samples, writing;
  for (const bake::BakeSummary& bake : evaluation.bakes) {
    reading.push_back(bake.seconds.reading);
    bases.push_back(bake.seconds.bases);
    samples.push_back(bake.seconds.samples);
    writing.push_back(bake.seconds.writing);
  }
  std::string text = "### Time\n\n| preprocessing (" + std::to_string(evaluation.bakes.size()) +
                     " bakes) | seconds, median |\n|---|---|\n";
  text += "| reading | " + number(median(reading)) + " |\n| bases | " + number(median(bases)) +
          " |\n| samples: correspondence, coefficients, depth images | " + number(median(samples)) +
          " |\n| calibrating, writing | " + number(median(writing)) + " |\n\n";
  const auto stage = [&](const auto& value) {
    std::vector<double> values;
    for (const TestTrial& test : evaluation.rounds.front().tests)
      for (const FrameTrial& frame : test.frames) values.push_back(static_cast<double>(value(frame)));
    return median(values);
  };
  const double points = stage([](const FrameTrial& f) { return f.points; });
  text += "| alignment of a frame of " + number(points, 0) + " points | ms, median |\n|---|---|\n";
  const auto row = [&](const char* name, double value) {
    text += "| " + std::string(name) + " | " + number(value, 3) + " |\n";
  };
  row("index of the cloud", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.index; }));
  row("correspondence", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.correspondence; }));
  row("projection", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.projection; }));
  row("search, VtP", 1e-6 * stage([](const FrameTrial& f) { return f.vtp_ns.matching; }));
  row("search, LBEA", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.matching; }));
  row("search of fit's proposals", 1e-6 * stage([](const FrameTrial& f) { return f.fit_ns.matching; }));
  row("fit: depth images and estimate", 1e-6 * stage([](const FrameTrial& f) { return f.fit_ns.fit; }));
  row("coverage", 1e-6 * stage([](const FrameTrial& f) { return f.lbea_ns.coverage; }));
  row("ICP, all of it", 1e3 * stage([](const FrameTrial& f) { return f.icp_s; }));
  return text + "\n";
}

}  // namespace

std::string tables(const Evaluation& evaluation) {
  if (evaluation.rounds.empty() || evaluation.rounds.front().tests.empty()) return "";
  std::string text;
  for (const Round& round : evaluation.rounds)
    if (undisturbed(round) && (round.title == "unseen" || round.title == "contained"))
      text += errors_table(round, evaluation.length_unit);
  text += branch_table(evaluation);
  for (const char* title : {"unseen", "contained"}) text += robustness_table(evaluation, title);
  return text + verdict_table(evaluation) + field_table(evaluation) + time_table(evaluation);
}

}  // namespace lbea::tool
