// What the bake learns about how tests end: ridge regressions from the shapes of a test so far to the final shape, the
// parameters and the channels of the run, and how wrong they are for runs that are left out.
#pragma once

#include "precompute/forecast/histories.hpp"
#include "precompute/parallel.hpp"

#include <vector>

namespace lbea::bake {

/// Owns the memory of a LearnedForecast's spans.
struct TrainedForecast {
  std::vector<double> numbers;
  std::vector<float> means, components, variances, runs, parameters;
  std::vector<double> channel_numbers;
  std::vector<float> channel_products;

  /// Zeros, for an ensemble that allows no training. runs: trained ones.
  TrainedForecast(std::size_t runs, std::size_t parameters, std::size_t channels);
};

/// Zeros without tests, or with fewer than four runs. The same on any number of threads.
[[nodiscard]] TrainedForecast learn_forecast(const Histories& histories, const Workers& workers);
/// The same of an ensemble. fit: of the source. parameters: one row per run; NaN: not given.
[[nodiscard]] TrainedForecast learn_forecast(const SampleSource& source, const LearnedFit& fit,
                                             const Eigen::MatrixXd& parameters, const Workers& workers);

}  // namespace lbea::bake
