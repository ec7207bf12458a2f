// How well forecasts predict the end of a test.
#pragma once

#include <lbea/forecast.hpp>

#include <optional>
#include <vector>

namespace lbea::tool {

/// Of the frames so far.
struct ForecastScore {
  double time_s = 0;                          // since impact, true
  double final_error = 0, error_90 = 0;       // EE of the final shape; its bound
  double brier = 0;                           // of the branches: sum of squared differences
  double update_ns = 0;                       // wall time of the frame's update
  std::vector<ParameterForecast> parameters;  // of the model
};

/// The forecasts of one test, and what is known without them.
struct ForecastTrial {
  double mean_error = 0, best_error = 0;  // EE of the final shape: mean of all runs, best run
  double prior_brier = 0;                 // of the runs' shares of the branches
  std::vector<double> parameters;         // true ones; empty: not known
  std::vector<ForecastScore> frames;
};

class ForecastJudge {
 public:
  /// truth: final positions on the nodes of the model, which has a forecast.
  ForecastJudge(const Model& model, std::vector<float> truth);
  /// time_s: of the frame.
  void add(const MatchResult& result, double time_s);
  /// With the frames so far.
  [[nodiscard]] const TestForecast& state() const noexcept { return forecast_.state(); }
  [[nodiscard]] ForecastTrial take() { return std::move(trial_); }

 private:
  [[nodiscard]] double brier(std::span<const float> probabilities) const;

  Model model_;
  Forecast forecast_;
  std::vector<float> truth_;
  std::uint32_t branch_ = 0;  // of the run with the nearest final shape
  ForecastTrial trial_;
};

}  // namespace lbea::tool
