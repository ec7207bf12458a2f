// From frames to the numbers of the tables: averaged over time per test, then over tests.
#pragma once

#include "tools/eval/trial.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::tool {

/// NaN where nothing was measured.
struct Score {
  double mean = not_measured;    // over the tests, of the mean over their frames
  double median = not_measured;  // over the tests, of the same
  double ratio = not_measured;   // mean over the oracle's mean; NaN when that is 0
  double exact = not_measured;   // share of the frames of contained experiments in which the own sample was named
};

struct Summary {
  std::size_t tests = 0, frames = 0;
  Score oracle;
  std::array<Score, contenders> scores;
  std::array<double, 4> verdicts{};  // shares of the frames, by Verdict
  std::array<double, 4>
      test_verdicts{};  // of the test so far: shares of the frames from which on it is given; NaN: of none
  double low_coverage = not_measured;  // share of the frames
  double named = not_measured;         // share of the contained tests in which the own simulation was named at the end
  FieldError field;
};

/// Values that are NaN are left out; none left: NaN.
[[nodiscard]] double mean(std::span<const double> values);
/// Of an even number: the mean of the middle two.
[[nodiscard]] double median(std::span<const double> values);

[[nodiscard]] Summary summarise(std::span<const TestTrial> tests);

/// Frames of a removed branch in which S without it does worse than twice as well as S with it could: before, the
/// branches have not parted and other simulations fit rightly. `with` and `without`: the same tests and frames.
struct Parted {
  std::size_t frames = 0;
  double no_simulation_fits = not_measured;  // share of them, frame by frame
  double test_says_so = not_measured;        // share of them that have a verdict of the test so far, by that
};
[[nodiscard]] Parted parted_frames(std::span<const TestTrial> without, std::span<const TestTrial> with);

}  // namespace lbea::tool
