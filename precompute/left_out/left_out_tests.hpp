// Frames of left-out runs, seen completely or with a part hidden, matched with the other runs.
#pragma once

#include "precompute/left_out/left_out_fitter.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/depth/shape_regression.hpp"

#include <Eigen/Core>

namespace lbea::bake {

/// Frames, and their candidates by each metric.
class LeftOutTests {
 public:
  /// hidden: the share of the cells that something hides; workers: the threads that match them.
  LeftOutTests(const SampleSource& source, std::span<const DepthMetric> metrics, std::vector<std::size_t> samples,
               double hidden, const Workers& workers, HiddenPlace place = HiddenPlace::of_frame);
  /// The same for at most `most` samples, spread over the ensemble.
  LeftOutTests(const SampleSource& source, std::span<const DepthMetric> metrics, std::size_t most, double hidden,
               const Workers& workers);

  [[nodiscard]] std::size_t metrics() const noexcept { return metrics_.size(); }
  [[nodiscard]] const LeftOutFrames& frames() const noexcept { return frames_; }
  /// By the candidates alone.
  [[nodiscard]] std::vector<FrameErrors> errors(std::size_t metric) const { return errors(metric, {metrics_[metric]}); }
  /// The same; costs: those of the metric, with any price of hidden parts and any prices of estimates.
  [[nodiscard]] std::vector<FrameErrors> errors(std::size_t metric, const FitCosts& costs) const {
    return errors(metric, costs, {}, {}, false, 1);
  }
  /// As the runtime publishes estimates: they follow the regression if `blend`, its share, is not 0, and are moved to
  /// the points. predicted: one row of shape scores per frame. every: only each such frame is matched; 1: all.
  [[nodiscard]] std::vector<FrameErrors> published_errors(std::size_t metric, const FitCosts& costs,
                                                          const ShapeRegression& regression, float blend,
                                                          const Eigen::MatrixXd& predicted,
                                                          std::size_t every = 1) const {
    return blend > 0 ? errors(metric, costs, regression, predicted, true, every)
                     : errors(metric, costs, {}, {}, true, every);
  }

 private:
  /// predicted: without rows, the candidates alone determine the estimates. corrects: see LeftOutFitter::errors().
  [[nodiscard]] std::vector<FrameErrors> errors(std::size_t metric, const FitCosts& costs,
                                                const ShapeRegression& regression, const Eigen::MatrixXd& predicted,
                                                bool corrects, std::size_t every) const;
  [[nodiscard]] std::uint32_t proposed() const noexcept;
  void add_prediction(const ShapeRegression& regression, const Eigen::RowVectorXd& scores, LeftOutFrame& frame) const;

  const SampleSource& source_;
  std::span<const DepthMetric> metrics_;
  Workers workers_;
  bool is_hidden_;
  LeftOutFrames frames_;
  std::vector<BestSamples> best_;
};

/// The metrics among which the bake chooses, the default first.
[[nodiscard]] std::vector<DepthMetric> metrics_in(std::string_view length_unit);

/// The index of the metric with the least errors of whole and hidden frames, the latter with the usual price of hidden
/// parts, and its errors of whole ones. Metrics differ little: the first one, unless another is better by more than the
/// standard error of the difference. whole, hidden: of the same samples.
[[nodiscard]] std::pair<std::size_t, std::vector<FrameErrors>> choose_metric(const LeftOutTests& whole,
                                                                             const LeftOutTests& hidden);

/// Takes the price of hidden parts with which the frames' errors are least. Returns these.
[[nodiscard]] std::vector<FrameErrors> learn_hidden_price(const LeftOutTests& hidden, FitCosts& costs);

/// The errors of the same frames in each call, with the given prices.
using ErrorsByPrices = std::function<std::vector<FrameErrors>(const EstimatePrices& prices)>;

/// Tries a quarter and a sixteenth of each of these prices; if a quarter is no better, four and sixteen times. Takes a
/// step if it reduces the errors by more than three standard errors of the difference, with one sum per run.
void learn_prices(std::span<float EstimatePrices::*const> which, const ErrorsByPrices& errors_by,
                  EstimatePrices& prices);

/// The samples at the times of the forecast, of `most` left-out runs spread over the ensemble.
[[nodiscard]] std::vector<std::size_t> samples_of_tests(const SampleSource& source, std::size_t most);

}  // namespace lbea::bake
