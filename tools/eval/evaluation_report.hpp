// Scores of an evaluation, and its tables, JSON and CSV files.
#pragma once

#include "tools/eval/evaluation.hpp"
#include "tools/eval/trial.hpp"

namespace lbea::tool {

/// NaN where nothing was measured.
struct Score {
  double mean = not_measured;    // over the tests, of the means over their frames
  double median = not_measured;  // over the tests, of the same means
  double ratio = not_measured;   // mean divided by the mean of the oracle; NaN when that is 0
  double exact = not_measured;   // share of the frames of contained experiments whose own sample was found
};

struct Summary {
  std::size_t tests = 0, frames = 0;
  Score oracle;
  std::array<Score, evaluated_methods> scores;
  std::array<double, 4> verdicts{};  // shares of the frames, by Verdict
  /// Of the test so far: shares of the frames that have this verdict; NaN: no frame has.
  std::array<double, 4> test_verdicts{};
  double named = not_measured;  // share of the contained tests whose own simulation was found at the end
  FieldError field;
  std::array<BoundCheck, bounded_names.size()> bounds;

  [[nodiscard]] const Score& of(EvaluatedMethod method) const { return scores[static_cast<std::size_t>(method)]; }
};

/// NaN values are left out; without others the result is NaN.
[[nodiscard]] double mean(std::span<const double> values);
/// As mean(). Of an even number of values: the mean of the middle two.
[[nodiscard]] double median(std::span<const double> values);

[[nodiscard]] Summary summarize(std::span<const TestTrial> tests);

/// The methods of tables that have a column per method.
inline constexpr std::array tabulated_methods{
    EvaluatedMethod::vtp,      EvaluatedMethod::lbea,    EvaluatedMethod::look_alike, EvaluatedMethod::fit,
    EvaluatedMethod::estimate, EvaluatedMethod::tracked, EvaluatedMethod::path};

/// Of the tests of one fold, or the mean or the greatest value over the folds.
struct FoldRow {
  std::string name;                                           // "1", "2", ..., "mean", "worst"
  std::size_t tests = 0;                                      // of the fold; of all in the last two rows
  std::array<double, 1 + tabulated_methods.size()> values{};  // the oracle's mean EE; ratios of the methods' to it
};
/// Empty unless there are several folds and any has several tests.
[[nodiscard]] std::vector<FoldRow> fold_rows(std::span<const TestTrial> tests);

/// The tests of the first round in which the mean EE of fit exceeds the oracle's most, greatest difference first. Tests
/// without any difference are left out.
struct WorstTest {
  const TestTrial* test;
  Summary summary;  // of this test
};
[[nodiscard]] std::vector<WorstTest> worst_tests(const Evaluation& evaluation, std::size_t most = 10);

/// Frames of a removed branch whose oracle error without the branch is more than twice that with it. In earlier frames
/// the branches have not diverged, and other simulations fit. `with` and `without`: the same tests and frames.
struct DivergedFrames {
  std::size_t frames = 0;
  double no_simulation_fits = not_measured;       // share of them by the verdict of the frame
  double test_no_simulation_fits = not_measured;  // by the verdict of the test so far; share of those that have one
};
[[nodiscard]] DivergedFrames diverged_frames(std::span<const TestTrial> without, std::span<const TestTrial> with);

/// One line, and the first lines with a title, of a table in Markdown.
[[nodiscard]] std::string table_line(const std::vector<std::string>& cells);
[[nodiscard]] std::string table_head(const std::string& title, const std::vector<std::string>& columns);

/// All tables, as Markdown.
[[nodiscard]] std::string tables(const Evaluation& evaluation);

[[nodiscard]] std::string to_json(const Evaluation& evaluation);

/// Writes FOLDER/tables.md, summary.json, frames.csv (a line per frame and round), view.csv (a line per sample and per
/// undisturbed unseen frame), worst.csv (a line per test of worst_tests()) and for line N worst/N.csv (a line per cell
/// of the depth images of its worst frame). Throws Error{write_failed}.
void write_evaluation(const std::filesystem::path& folder, const Evaluation& evaluation);

}  // namespace lbea::tool
