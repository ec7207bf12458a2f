#include "tools/eval/forecast/forecast_score.hpp"

#include "tools/eval/truth.hpp"

#include <chrono>
#include <limits>

namespace lbea::tool {

ForecastJudge::ForecastJudge(const Model& model, std::vector<float> truth)
    : model_(model), forecast_(model), truth_(std::move(truth)) {
  std::vector<float> shares(model.simulations());
  trial_.best_error = std::numeric_limits<double>::infinity();
  for (std::uint32_t run = 0; run < model.simulations(); ++run) {
    TestForecast this_run;
    std::ranges::fill(shares, 0.0f);
    shares[run] = 1;
    this_run.run_weights = shares;
    const double error = experiment_error(truth_, final_positions(model, this_run));
    if (error >= trial_.best_error) continue;
    trial_.best_error = error;
    branch_ = model.branch_of(run);
  }
  const TestForecast& prior = forecast_.state();
  trial_.mean_error = experiment_error(truth_, final_positions(model, prior));
  trial_.prior_brier = brier(prior.branch_probabilities);
}

void ForecastJudge::add(const MatchResult& result, double time_s) {
  const auto start = std::chrono::steady_clock::now();
  const TestForecast& now = forecast_.update(result);
  const std::chrono::duration<double, std::nano> elapsed = std::chrono::steady_clock::now() - start;
  trial_.frames.push_back({time_s,
                           experiment_error(truth_, final_positions(model_, now)),
                           double{now.error_90},
                           brier(now.branch_probabilities),
                           elapsed.count(),
                           {now.parameters.begin(), now.parameters.end()}});
}

double ForecastJudge::brier(std::span<const float> probabilities) const {
  double sum = 0;
  for (std::size_t branch = 0; branch < probabilities.size(); ++branch) {
    const double off = double{probabilities[branch]} - (branch == branch_ ? 1 : 0);
    sum += off * off;
  }
  return sum;
}

}  // namespace lbea::tool
