#include "precompute/left_out/left_out_tests.hpp"

#include "runtime/src/forecast/learned_forecast.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

namespace lbea::bake {
namespace {

constexpr std::uint32_t most_neighbors = 2 * FitSettings{}.neighbors;  // proposed for the estimate of a left-out frame

double sum_of(const FrameErrors& error) { return error.estimate + error.match; }

double total(std::span<const FrameErrors> errors) {
  double sum = 0;
  for (const FrameErrors& error : errors) sum += sum_of(error);
  return sum;
}

std::vector<double> sums_by_run(std::span<const FrameErrors> errors) {
  std::map<std::uint32_t, double> by_run;
  for (const FrameErrors& error : errors) by_run[error.simulation] += sum_of(error);
  std::vector<double> sums;
  for (const auto& [run, sum] : by_run) sums.push_back(sum);
  return sums;
}

/// Per sample, seen completely and with a hidden part.
std::vector<double> sums_of(std::span<const FrameErrors> whole, std::span<const FrameErrors> hidden) {
  std::vector<double> sums;
  for (std::size_t i = 0; i < whole.size(); ++i) sums.push_back(sum_of(whole[i]) + sum_of(hidden[i]));
  return sums;
}

/// How much smaller the errors are in total than others of the same samples or runs, in standard errors of the
/// difference.
double significance(std::span<const double> errors, std::span<const double> others) {
  double sum = 0, squares = 0;
  for (std::size_t i = 0; i < errors.size(); ++i) {
    const double less = others[i] - errors[i];
    sum += less, squares += less * less;
  }
  const double variance = squares - sum * sum / static_cast<double>(errors.size());
  return variance > 0 ? sum / std::sqrt(variance) : 0;
}

}  // namespace

LeftOutTests::LeftOutTests(const SampleSource& source, std::span<const DepthMetric> metrics,
                           std::vector<std::size_t> samples, double hidden, const Workers& workers, HiddenPlace place)
    : source_(source),
      metrics_(metrics),
      workers_(workers),
      is_hidden_(hidden > 0),
      frames_(source, std::move(samples), hidden,
              is_hidden_ ? 0 : metrics.front().mesh_noise / source.camera.depth_step, place),
      best_(best_of_others(source, frames_, metrics, proposed(), workers)) {}

LeftOutTests::LeftOutTests(const SampleSource& source, std::span<const DepthMetric> metrics, std::size_t most,
                           double hidden, const Workers& workers)
    : LeftOutTests(source, metrics, spread_samples(std::min(most, source.samples.size()), source.samples.size()),
                   hidden, workers) {}

std::vector<FrameErrors> LeftOutTests::errors(std::size_t metric, const FitCosts& costs,
                                              const ShapeRegression& regression, const Eigen::MatrixXd& predicted,
                                              bool corrects, std::size_t every) const {
  const bool is_predicted = predicted.rows() > 0;
  std::vector<FrameErrors> errors((frames_.size() + every - 1) / every);
  work_in_parallel(errors.size(), workers_, [&](const auto& next) {
    LeftOutFitter fitter(source_, costs, proposed() + (is_predicted ? most_neighbors : 0), regression);
    for (std::size_t matched = next(); matched < errors.size(); matched = next()) {
      const std::size_t i = matched * every;
      LeftOutFrame left_out(frames_, i, best_[metric * frames_.size() + i], is_hidden_);
      if (is_predicted) add_prediction(regression, predicted.row(static_cast<Eigen::Index>(i)), left_out);
      errors[matched] = fitter.errors(left_out, nullptr, corrects);
    }
  });
  return errors;
}

/// By what a frame shows. Where something hides a part, that proposes samples of which only some are good.
std::uint32_t LeftOutTests::proposed() const noexcept {
  return is_hidden_ ? DepthRanking::most_promising : FitSettings{}.candidates;
}

/// Proposes the samples of other simulations nearest to the prediction, too.
void LeftOutTests::add_prediction(const ShapeRegression& regression, const Eigen::RowVectorXd& scores,
                                  LeftOutFrame& frame) const {
  const Eigen::RowVectorXf rounded = scores.cast<float>();
  frame.predicted.assign(rounded.begin(), rounded.end());
  BestSamples nearest(most_neighbors);
  for (std::uint32_t s = 0; s < source_.samples.size(); ++s)
    if (source_.samples[s].simulation != source_.samples[frame.sample].simulation &&
        std::ranges::find(frame.proposed, s) == frame.proposed.end())
      nearest.offer(s, squared_distance(regression.shape(s), frame.predicted));
  for (const RankedSample& one : nearest.ranked()) frame.proposed.push_back(one.sample);
}

/// High costs distinguish large deformations; with low costs a fold that lies a few millimeters elsewhere costs little.
std::vector<DepthMetric> metrics_in(std::string_view length_unit) {
  std::vector<DepthMetric> metrics;
  for (const float scale : {1.0f, 0.25f, 0.5f, 2.0f, 4.0f}) {
    DepthMetric metric = DepthMetric{}.in(length_unit);
    metric.cap *= scale;
    metric.one_sided *= scale;
    metric.hidden *= scale;
    metrics.push_back(metric);
  }
  return metrics;
}

std::pair<std::size_t, std::vector<FrameErrors>> choose_metric(const LeftOutTests& whole, const LeftOutTests& hidden) {
  // Samples of one run count as independent. If each run counted once, small ensembles would always keep the first
  // metric, whose estimates are no worse for whole frames, but worse where a part is hidden.
  std::pair<std::size_t, std::vector<FrameErrors>> chosen{0, whole.errors(0)};
  const std::vector<double> first = sums_of(chosen.second, hidden.errors(0));
  double least = std::accumulate(first.begin(), first.end(), 0.0);
  for (std::size_t m = 1; m < whole.metrics(); ++m) {
    std::vector<FrameErrors> errors = whole.errors(m);
    const std::vector<double> sums = sums_of(errors, hidden.errors(m));
    const double total = std::accumulate(sums.begin(), sums.end(), 0.0);
    if (!(total < least && significance(sums, first) > 1)) continue;
    chosen = {m, std::move(errors)};
    least = total;
  }
  return chosen;
}

std::vector<FrameErrors> learn_hidden_price(const LeftOutTests& hidden, FitCosts& costs) {
  std::vector<FrameErrors> least;
  FitCosts tried = costs;
  for (const float share : {0.25f, 0.3125f, 0.375f, 0.4375f, 0.5f, 0.75f}) {
    tried.metric.hidden = share * costs.metric.one_sided;
    std::vector<FrameErrors> errors = hidden.errors(0, tried);
    if (!least.empty() && total(errors) >= total(least)) continue;
    least = std::move(errors);
    costs.metric.hidden = tried.metric.hidden;
  }
  return least;
}

void learn_prices(std::span<float EstimatePrices::*const> which, const ErrorsByPrices& errors_by,
                  EstimatePrices& prices) {
  constexpr float factor = 4;
  constexpr int most_steps = 2;
  constexpr double clearly = 3;  // standard errors: several tries of few runs exceed 2 by chance
  std::vector<double> least = sums_by_run(errors_by(prices));
  const auto steps_taken = [&](float EstimatePrices::*price, float by) {
    EstimatePrices tried = prices;
    for (int step = 0; step < most_steps; ++step) {
      tried.*price *= by;
      std::vector<double> sums = sums_by_run(errors_by(tried));
      if (!(significance(sums, least) > clearly)) return step;
      prices = tried;
      least = std::move(sums);
    }
    return most_steps;
  };
  for (const auto price : which)
    if (steps_taken(price, 1 / factor) == 0) steps_taken(price, factor);
}

std::vector<std::size_t> samples_of_tests(const SampleSource& source, std::size_t most) {
  const std::vector<RunSamples> runs = samples_of_runs(source.samples);
  std::vector<std::size_t> chosen;
  if (source.times.empty()) return chosen;
  const ForecastTimes times(source.times);
  for (const std::size_t run : spread_samples(std::min(most, runs.size()), runs.size()))
    for (std::size_t node = 1; node <= LearnedForecast::nodes; ++node)
      chosen.push_back(runs[run].nearest(source.times, times.at(static_cast<double>(node))));
  return chosen;
}

}  // namespace lbea::bake
