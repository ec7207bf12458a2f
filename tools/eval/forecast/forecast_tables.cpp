#include "tools/eval/forecast/forecast_tables.hpp"

#include "runtime/src/depth/test_clock.hpp"
#include "tools/eval/evaluation_report.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::array shares{0.1, 0.2, 0.5, 1.0};  // of the duration

/// The last forecast until a time; null: none.
const ForecastScore* forecast_until(const ForecastTrial& trial, double time_s) {
  const ForecastScore* last = nullptr;
  for (const ForecastScore& frame : trial.frames)
    if (frame.time_s <= time_s) last = &frame;
  return last;
}

class ForecastTables {
 public:
  ForecastTables(const Round& round, const Model& model)
      : round_(round), model_(model), duration_(EnsembleTimes::of(model.view()).duration_s) {}

  [[nodiscard]] std::string ends(std::string_view unit) const {
    std::string text = table_head(
        "Forecast of the end, " + round_.title + " experiments, " + round_.disturbance.name,
        {"seen until", "tests", "error of the final shape [" + std::string(unit) + "]", "within error_90 (its mean)",
         "mean of all runs", "best run", "Brier score of the branches", "of the runs' shares"});
    for (const double share : shares) {
      std::vector<double> errors, within, bounds, of_mean, of_best, brier, prior;
      visit(share, [&](const ForecastTrial& test, const ForecastScore& frame) {
        errors.push_back(frame.final_error);
        within.push_back(frame.final_error <= frame.error_90 ? 1 : 0);
        bounds.push_back(frame.error_90);
        of_mean.push_back(test.mean_error);
        of_best.push_back(test.best_error);
        brier.push_back(frame.brier);
        prior.push_back(test.prior_brier);
      });
      text += table_line({time(share), std::to_string(errors.size()), formatted("%.2f", mean(errors)),
                          formatted("%.0f %% (%.1f)", 100 * mean(within), mean(bounds)),
                          formatted("%.2f", mean(of_mean)), formatted("%.2f", mean(of_best)),
                          formatted("%.3f", mean(brier)), formatted("%.3f", mean(prior))});
    }
    std::vector<double> times;
    for (const TestTrial& test : round_.tests)
      for (const ForecastScore& frame : test.forecast->frames) times.push_back(1e-3 * frame.update_ns);
    return text + formatted("\nMean EE at the last state. Median time per frame: %.1f us.\n\n", median(times));
  }

  [[nodiscard]] std::string parameters() const {
    std::vector<std::string> columns{"parameter"};
    for (const double share : shares) columns.push_back("R2, seen until " + time(share));
    columns.insert(columns.end(), {"within bound_90, all frames", "frames in which it is identifiable"});
    std::string text = table_head("Parameters, " + round_.title + " experiments, " + round_.disturbance.name, columns);
    for (std::uint32_t p = 0; p < model_.parameters(); ++p) {
      std::vector<std::string> cells{std::string(model_.parameter_name(p))};
      for (const double share : shares) cells.push_back(formatted("%.2f", r2(p, share)));
      cells.push_back(formatted("%.1f %%", 100 * of_frames(p, [](const ParameterForecast& forecast, double truth) {
                                             return std::abs(double{forecast.value} - truth) <=
                                                    double{forecast.bound_90};
                                           })));
      cells.push_back(formatted("%.0f %%", 100 * of_frames(p, [](const ParameterForecast& forecast, double) {
                                             return forecast.is_identifiable();
                                           })));
      text += table_line(cells);
    }
    return text + "\n";
  }

 private:
  [[nodiscard]] std::string time(double share) const { return formatted("%.1f ms", 1e3 * share * duration_); }
  template <class Visit>
  void visit(double share, const Visit& visit) const {
    constexpr double rounding = 1e-3;  // durations: stored times are not exact
    for (const TestTrial& test : round_.tests)
      if (const ForecastScore* frame = forecast_until(*test.forecast, (share + rounding) * duration_))
        visit(*test.forecast, *frame);
  }
  /// 1 - squared error / squared deviation from the mean, over the tests.
  [[nodiscard]] double r2(std::uint32_t p, double share) const {
    std::vector<double> truths, errors, deviations;
    visit(share, [&](const ForecastTrial& test, const ForecastScore& frame) {
      if (test.parameters.empty() || std::isnan(test.parameters[p])) return;
      truths.push_back(test.parameters[p]);
      errors.push_back(std::pow(double{frame.parameters[p].value} - test.parameters[p], 2));
    });
    for (const double truth : truths) deviations.push_back(std::pow(truth - mean(truths), 2));
    return 1 - mean(errors) / mean(deviations);
  }
  template <class Holds>
  [[nodiscard]] double of_frames(std::uint32_t p, const Holds& holds) const {
    std::vector<double> tests;
    for (const TestTrial& test : round_.tests) {
      std::vector<double> frames;
      if (test.forecast->parameters.empty() || std::isnan(test.forecast->parameters[p])) continue;
      for (const ForecastScore& frame : test.forecast->frames)
        frames.push_back(holds(frame.parameters[p], test.forecast->parameters[p]) ? 1 : 0);
      tests.push_back(mean(frames));
    }
    return mean(tests);
  }

  const Round& round_;
  const Model& model_;
  double duration_;
};

}  // namespace

std::string forecast_tables(const Evaluation& evaluation) {
  std::string text;
  for (const Round& round : evaluation.rounds) {
    const auto is_forecast = [](const TestTrial& test) { return test.forecast.has_value(); };
    if (round.title != "unseen" || !std::ranges::all_of(round.tests, is_forecast) || !evaluation.model) continue;
    const ForecastTables tables(round, *evaluation.model);
    text += tables.ends(evaluation.length_unit) + tables.parameters();
  }
  return text;
}

}  // namespace lbea::tool
