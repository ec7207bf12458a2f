// What forecasts are learned from: the shapes of the runs over time, and those that left-out tests seem to have.
#pragma once

#include "precompute/depth_images/learned_fit.hpp"
#include "runtime/src/forecast/learned_forecast.hpp"

#include <array>

namespace lbea::bake {

/// Shapes are one row of nodes x shape_scores: at the first node, at the second one, ...
struct Histories {
  static constexpr Eigen::Index nodes = LearnedForecast::nodes, scores = LearnedForecast::shape_scores, none = -1;

  Eigen::MatrixXd means;       // of the trained runs' shapes over time, as in LearnedForecast
  Eigen::MatrixXd shapes;      // trained runs: deviations from the means
  Eigen::MatrixXd finals;      // trained runs: final positions of some nodes
  Eigen::MatrixXd parameters;  // trained runs; the mean where not given
  /// One per channel, trained runs: its values at the impact and at the nodes.
  std::vector<Eigen::MatrixXd> channels;

  /// Left-out tests, each with two errors of the clock.
  struct Tests {
    Eigen::MatrixXd shapes;      // deviations of the estimates from the means
    Eigen::MatrixXd errors;      // of these
    Eigen::MatrixXd finals;      // true ones
    Eigen::MatrixXd parameters;  // NaN: not given
    std::vector<Eigen::MatrixXd> channels;
    std::size_t runs = 0;
    std::vector<Eigen::Index> trained_rows;  // per test: its own row of the trained runs; none: not trained
  };
  std::array<Tests, LearnedForecast::kinds> tests;  // seen completely; with a third hidden
};

/// fit: of the source, with the shapes of all samples. parameters: one row per run; NaN: not given.
[[nodiscard]] Histories read_histories(const SampleSource& source, const LearnedFit& fit,
                                       const Eigen::MatrixXd& parameters);

}  // namespace lbea::bake
