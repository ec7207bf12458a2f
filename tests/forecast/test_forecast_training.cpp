// What the bake learns about how tests end, on runs whose end follows exactly from their beginning.
#include "precompute/forecast/forecast_training.hpp"

#include "precompute/rig/counter_random.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;

namespace {

using Eigen::Index, Eigen::MatrixXd;

constexpr Index nodes = LearnedForecast::nodes, scores = LearnedForecast::shape_scores, runs_on_line = 60;

double drawn(std::uint64_t seed, std::uint64_t i) { return CounterRandom(seed, i).normal(); }

void set_errors(Histories::Tests& tests, const MatrixXd& truth, double noise) {
  tests.errors.resize(truth.rows(), truth.cols());
  std::uint64_t draws = 0;
  for (double& error : tests.errors.reshaped()) error = noise * drawn(2, draws++);
  tests.shapes = truth + tests.errors;
}

/// Runs on a line in the space of shapes: run r is off by c_r k in the first score at node k, ends 20 c_r mm from the
/// mean, and has the parameters 5 + 3 c_r and one that nothing shows. Its channel is 50 + 4 c_r (k + 1) at node k. The
/// estimates of left-out tests are off by `noise`.
Histories on_a_line(double noise = 1e-3) {
  Histories histories;
  histories.means = MatrixXd::Zero(1 + nodes * Index{LearnedForecast::means_per_node}, scores);
  histories.shapes = MatrixXd::Zero(runs_on_line, nodes * scores);
  histories.finals = MatrixXd::Zero(runs_on_line, 6);
  histories.parameters.resize(runs_on_line, 2);
  histories.channels.assign(1, MatrixXd(runs_on_line, 1 + nodes));
  Histories::Tests& tests = histories.tests.front();
  tests.runs = runs_on_line;
  for (Index run = 0; run < runs_on_line; ++run) {
    const double c = (static_cast<double>(run) - 0.5 * (runs_on_line - 1)) / runs_on_line;
    for (Index node = 0; node < nodes; ++node) histories.shapes(run, node * scores) = c * static_cast<double>(node + 1);
    for (Index node = 0; node <= nodes; ++node)
      histories.channels[0](run, node) = 50 + 4 * c * static_cast<double>(node + 1);
    histories.finals(run, 1) = histories.finals(run, 4) = 20 * c;
    histories.parameters(run, 0) = 5 + 3 * c;
    histories.parameters(run, 1) = drawn(1, static_cast<std::uint64_t>(run));
    tests.trained_rows.push_back(run);
  }
  tests.finals = histories.finals;
  tests.parameters = histories.parameters;
  tests.channels = histories.channels;
  set_errors(tests, histories.shapes, noise);
  return histories;
}

/// What a forecast from the nodes `first` to `node` is worth; node 0: from nothing.
struct Numbers {
  double error_90;
  struct {
    double r2, bound_90;
  } parameters[2];
};
Numbers numbers_of(const TrainedForecast& trained, std::size_t node, std::size_t first = 1, std::size_t kind = 0) {
  const std::size_t row = node == 0 ? 0 : 1 + ForecastWindow{first, node}.number();
  const auto n = std::span(trained.numbers).subspan(8 * (kind * (1 + ForecastWindow::count) + row), 8);
  return {n[0], {{n[2], n[3]}, {n[5], n[6]}}};
}

}  // namespace

TEST_CASE("what follows exactly is forecast from the first node on, and what does not is not identifiable") {
  const TrainedForecast trained = learn_forecast(on_a_line(), 1);
  for (std::size_t node = 1; node <= LearnedForecast::nodes; ++node) {
    CAPTURE(node);
    const Numbers numbers = numbers_of(trained, node);
    // The first score is known to 1e-3, of which 20 mm follow at node 1, and less at later ones.
    CHECK(numbers.error_90 < 20 * 3e-3);
    CHECK(numbers.parameters[0].r2 > 0.99);
    CHECK(numbers.parameters[0].bound_90 < 3 * 3e-3);
    CHECK(numbers.parameters[1].r2 < 0.2);
  }
}

TEST_CASE("channels of the moment and of the end follow from the shapes, before anything is seen from none") {
  const TrainedForecast trained = learn_forecast(on_a_line(), 1);
  const auto bounds = [&](std::size_t row) {
    return std::pair(trained.channel_numbers[row * LearnedForecast::numbers_per_channel],
                     trained.channel_numbers[row * LearnedForecast::numbers_per_channel + 2]);
  };
  // The runs' c are even between -0.5 and 0.5: 90 % of them are within 0.46 of their mean.
  CHECK(bounds(0).first == doctest::Approx(4 * 0.46).epsilon(0.05));
  CHECK(bounds(0).second == doctest::Approx(4 * 11 * 0.46).epsilon(0.05));
  for (std::size_t node = 1; node <= LearnedForecast::nodes; ++node) {
    CAPTURE(node);
    const auto [now, end] = bounds(1 + ForecastWindow{1, node}.number());
    // c is known to 1e-3 from node 1, and better with later ones.
    CHECK(now < 4 * static_cast<double>(node + 1) * 3e-3);
    CHECK(end < 4 * 11 * 3e-3);
    CHECK(now > 0);
  }
}

TEST_CASE("before anything is seen, the bounds are those of the mean of the other runs") {
  const Histories histories = on_a_line();
  const TrainedForecast trained = learn_forecast(histories, 1);
  // The mean of the others is off by n / (n - 1) of a run's deviation; 0.9 (n + 1) / n of the runs are to be held.
  std::vector<double> off;
  for (Index run = 0; run < runs_on_line; ++run)
    off.push_back(std::abs(histories.finals(run, 1)) * runs_on_line / (runs_on_line - 1));
  std::ranges::sort(off);
  const auto held = static_cast<std::size_t>(std::ceil(0.9 * (runs_on_line + 1)));
  CHECK(numbers_of(trained, 0).error_90 == doctest::Approx(off[held - 1]));
  CHECK(numbers_of(trained, 0).parameters[0].r2 == 0);
}

TEST_CASE("bounds are those of runs that are left out: a run that is unlike the others does not forecast itself") {
  Histories histories = on_a_line();
  // One run in eight ends where no other run like it does: more than bounds of 90 % may ignore.
  for (Index run = 0; run < runs_on_line; run += 8)
    histories.finals(run, 1) += drawn(3, static_cast<std::uint64_t>(run)) * 1e3;
  histories.tests.front().finals = histories.finals;
  CHECK(numbers_of(learn_forecast(histories, 1), 5).error_90 > 50);
}

TEST_CASE("with wrong estimates, bounds are wider and less is identifiable") {
  double before = 0, explained = 1;
  for (const double noise : {1e-3, 0.1, 1.0, 10.0}) {
    const TrainedForecast trained = learn_forecast(on_a_line(noise), 1);
    CHECK(numbers_of(trained, 2).error_90 > before);
    CHECK(numbers_of(trained, 2).parameters[0].r2 <= explained);
    before = numbers_of(trained, 2).error_90;
    explained = numbers_of(trained, 2).parameters[0].r2;
  }
  CHECK(explained < 0.2);
  CHECK(before <= numbers_of(learn_forecast(on_a_line(10), 1), 0).error_90 * 1.1);  // hardly worse than knowing nothing
}

TEST_CASE("the forecast does not depend on threads, and needs four runs and tests of left-out ones") {
  const TrainedForecast one = learn_forecast(on_a_line(0.1), 1), many = learn_forecast(on_a_line(0.1), 4);
  CHECK(one.numbers == many.numbers);
  CHECK(one.components == many.components);
  CHECK(one.variances == many.variances);
  CHECK(one.runs == many.runs);
  CHECK(one.parameters == many.parameters);
  CHECK(one.channel_numbers == many.channel_numbers);
  CHECK(one.channel_products == many.channel_products);
  Histories untested = on_a_line();
  untested.tests = {};
  CHECK(learn_forecast(untested, 1).numbers == std::vector<double>(one.numbers.size(), 0.0));
}

TEST_CASE("parameters that are not given for a run neither count nor spoil those of others") {
  Histories histories = on_a_line();
  histories.tests.front().parameters(7, 0) = std::nan("");
  histories.parameters(7, 0) = histories.parameters.col(0).mean();
  const TrainedForecast trained = learn_forecast(histories, 1);
  CHECK(numbers_of(trained, 3).parameters[0].r2 > 0.95);
  CHECK(std::isfinite(numbers_of(trained, 3).parameters[0].bound_90));
}

// Regression: the regressions needed the first tenth of a test.
TEST_CASE("a test whose beginning was not seen is forecast from what was") {
  const TrainedForecast trained = learn_forecast(on_a_line(0.1), 1);
  for (std::size_t first = 1; first <= LearnedForecast::nodes; ++first) {
    CAPTURE(first);
    const Numbers numbers = numbers_of(trained, LearnedForecast::nodes, first);
    // The end alone tells c to 0.1 / 10, of which 20 mm and 3 units follow; earlier nodes add little.
    CHECK(numbers.error_90 < 20 * 3e-2);
    CHECK(numbers.parameters[0].r2 > 0.95);
    CHECK(numbers.parameters[1].r2 < 0.2);
  }
  // One node alone: the later, the better, as the runs differ more and more.
  CHECK(numbers_of(trained, 9, 9).error_90 < numbers_of(trained, 1, 1).error_90);
}

// Regression: bounds and what is identifiable were those of tests that were seen completely.
TEST_CASE("tests with a hidden part have bounds of their own, and less is identifiable") {
  Histories histories = on_a_line();
  Histories::Tests& hidden = histories.tests[1] = histories.tests[0];
  set_errors(hidden, histories.shapes, 2);
  const TrainedForecast trained = learn_forecast(histories, 1), without = learn_forecast(on_a_line(), 1);
  for (const std::size_t node : {std::size_t{1}, std::size_t{5}, std::size_t{10}}) {
    CAPTURE(node);
    const Numbers seen = numbers_of(trained, node), behind = numbers_of(trained, node, 1, 1);
    CHECK(seen.error_90 == numbers_of(without, node).error_90);
    CHECK(behind.error_90 > 10 * seen.error_90);
    CHECK(behind.parameters[0].bound_90 > 10 * seen.parameters[0].bound_90);
    CHECK(behind.parameters[0].r2 < seen.parameters[0].r2);
  }
  // Without such tests, what was seen completely stands for both.
  CHECK(numbers_of(without, 5, 1, 1).error_90 == numbers_of(without, 5).error_90);
}

TEST_CASE("the windows of a forecast are numbered without gaps, and so are their components") {
  std::size_t number = 0, sizes = 0;
  for (std::size_t first = 1; first <= LearnedForecast::nodes; ++first)
    for (std::size_t last = first; last <= LearnedForecast::nodes; ++last) {
      const ForecastWindow window{first, last};
      CHECK(window.number() == number++);
      CHECK(window.sizes_before() == sizes);
      sizes += window.size();
    }
  CHECK(number == ForecastWindow::count);
  CHECK(sizes == LearnedForecast::all_sizes);
}
