#include "precompute/forecast/forecast_training.hpp"

#include "precompute/depth_images/learned_bounds.hpp"
#include "precompute/parallel.hpp"

#include <Eigen/Eigenvalues>

#include <cmath>

namespace lbea::bake {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd, Eigen::VectorXd;

constexpr Index most_components = LearnedForecast::most_components;
constexpr Index fewest_runs = 4;

/// One over the standard deviation of the estimates' errors, per feature: a shape counts as far as it is known. Errors
/// of single features are averaged with those of the node.
RowVectorXd scales_of(const Histories& histories) {
  constexpr double least = 1e-6;  // of the runs' variance
  const auto tests = static_cast<double>(histories.errors.rows());
  RowVectorXd variances = histories.errors.colwise().squaredNorm() / tests;
  for (Index node = 0; node < Histories::nodes; ++node) {
    auto of_node = variances.segment(node * Histories::scores, Histories::scores);
    const double floor = least *
                         histories.shapes.middleCols(node * Histories::scores, Histories::scores).squaredNorm() /
                         static_cast<double>(histories.shapes.rows());
    of_node = (0.5 * (of_node.array() + of_node.mean())).max(std::max(floor, 1e-30));
  }
  return variances.cwiseSqrt().cwiseInverse();
}

/// Principal components of the runs' shapes up to a node, and the values of runs and tests.
struct Components {
  MatrixXd rows;         // components x features
  VectorXd variances;    // times the number of runs, descending
  MatrixXd runs, tests;  // x components
};

/// From the rows' Gram matrix. shapes, tests: scaled.
Components components_of(const MatrixXd& shapes, const MatrixXd& tests) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> solver(MatrixXd(shapes * shapes.transpose()));
  const VectorXd& all = solver.eigenvalues();
  Index count = 0;
  while (count < all.size() && all(all.size() - 1 - count) > 1e-10 * all(all.size() - 1)) ++count;
  Components found;
  found.variances = all.tail(count).reverse();
  const MatrixXd vectors = solver.eigenvectors().rightCols(count).rowwise().reverse();
  const VectorXd lengths = found.variances.cwiseSqrt();
  found.rows = lengths.cwiseInverse().asDiagonal() * (vectors.transpose() * shapes);
  found.runs = vectors * lengths.asDiagonal();
  found.tests = tests * found.rows.transpose();
  return found;
}

/// Ridge regression with a constant that is not penalized, for any ridge.
class Ridge {
 public:
  /// Keeps references. own: see Histories::trained_rows.
  Ridge(const Components& components, const MatrixXd& targets, std::span<const Index> own)
      : components_(components),
        targets_(targets),
        own_(own),
        mean_(targets.colwise().mean()),
        products_(components.runs.transpose() * (targets.rowwise() - mean_)) {}

  /// Components x targets.
  [[nodiscard]] MatrixXd weights(double ridge) const {
    return (components_.variances.array() + ridge).inverse().matrix().asDiagonal() * products_;
  }
  /// Of the tests, one row each, each by the regression without its own run. With residual r and leverage h of that
  /// run, and the cross leverage g of run and test, it predicts g / (1 - h) r less than the regression with the run.
  [[nodiscard]] MatrixXd left_out(double ridge) const {
    const MatrixXd weights_of_all = weights(ridge);
    MatrixXd predicted = (components_.tests * weights_of_all).rowwise() + mean_;
    const VectorXd inverse = (components_.variances.array() + ridge).inverse();
    const double constant = 1 / static_cast<double>(targets_.rows());
    for (Index test = 0; test < predicted.rows(); ++test) {
      const Index run = own_[static_cast<std::size_t>(test)];
      if (run == Histories::none) continue;
      const RowVectorXd of_run = components_.runs.row(run), weighed = of_run.cwiseProduct(inverse.transpose());
      const RowVectorXd residual = targets_.row(run) - mean_ - of_run * weights_of_all;
      const double h = constant + weighed.dot(of_run), g = constant + weighed.dot(components_.tests.row(test));
      predicted.row(test) -= g / std::max(1 - h, 1e-9) * residual;
    }
    return predicted;
  }

 private:
  const Components& components_;
  const MatrixXd& targets_;
  std::span<const Index> own_;
  RowVectorXd mean_;
  MatrixXd products_;
};

/// Ridges to choose from.
std::vector<double> ridges_for(const VectorXd& variances) {
  constexpr int count = 23;  // the greatest leaves nothing of what was seen
  std::vector<double> ridges;
  for (int i = 0; i < count; ++i) ridges.push_back(variances.sum() * std::pow(10.0, -7 + i / 2.0));
  return ridges;
}

/// Holds 90 % of those of one more run.
double bound_of(std::span<const double> errors, std::size_t runs) {
  std::vector<WeightedValue> values;
  for (const double error : errors)
    if (std::isfinite(error)) values.push_back({std::abs(error), 1});
  return weighted_quantile(std::move(values), share_to_hold(runs));
}

/// Mean distance of nodes, per row.
std::vector<double> mean_distances(const MatrixXd& a, const MatrixXd& b) {
  std::vector<double> distances;
  for (Index i = 0; i < a.rows(); ++i) {
    double sum = 0;
    for (Index j = 0; j < a.cols(); j += 3) sum += (a.row(i).segment(j, 3) - b.row(i).segment(j, 3)).norm();
    distances.push_back(3 * sum / static_cast<double>(a.cols()));
  }
  return distances;
}

/// 1 - sum of squared errors / sum of squared deviations from the mean, less its standard error; of known values.
double explained_share(std::span<const double> errors, const VectorXd& truth) {
  double mean = 0, count = 0, left = 0, all = 0, squares = 0;
  for (const double value : truth)
    if (std::isfinite(value)) mean += value, ++count;
  const auto visit = [&](const auto& add) {
    for (std::size_t i = 0; i < errors.size(); ++i)
      if (std::isfinite(errors[i]))
        add(errors[i] * errors[i], std::pow(truth(static_cast<Index>(i)) - mean / count, 2));
  };
  visit([&](double error, double deviation) { left += error, all += deviation; });
  if (!(all > 0)) return 0;
  visit([&](double error, double deviation) { squares += std::pow(error - left / all * deviation, 2); });
  constexpr double tests_per_run = 2;  // with other errors of the clock: hardly independent
  return 1 - left / all - std::sqrt(tests_per_run * squares) / all;
}

double sum_of(std::span<const double> values) {
  double sum = 0;
  for (const double value : values) sum += value;
  return sum;
}

class NodeTraining {
 public:
  /// node: from 1; 0: nothing has been seen.
  NodeTraining(const Histories& histories, const RowVectorXd& scales, Index node, TrainedForecast& trained)
      : histories_(histories),
        node_(node),
        trained_(trained),
        scales_(scales.head(node * Histories::scores)),
        components_(components_of(histories.shapes.leftCols(scales_.size()) * scales_.asDiagonal(),
                                  histories.tests.leftCols(scales_.size()) * scales_.asDiagonal())),
        ridges_(node == 0 ? std::vector<double>{1} : ridges_for(components_.variances)) {}

  void train() {
    write_components();
    train_finals();
    for (Index p = 0; p < histories_.parameters.cols(); ++p) train_parameter(p);
  }

 private:
  [[nodiscard]] Index kept() const { return std::min<Index>(components_.variances.size(), most_components); }
  [[nodiscard]] double& number(Index i) {
    return trained_.numbers[static_cast<std::size_t>(node_ * (1 + 2 * histories_.parameters.cols()) + i)];
  }
  void write_components() {
    for (Index c = 0; c < kept(); ++c)
      for (Index f = 0; f < scales_.size(); ++f)
        trained_.components[static_cast<std::size_t>(
            ((node_ - 1) * most_components + c) * Histories::nodes * Histories::scores + f)] =
            static_cast<float>(components_.rows(c, f) * scales_(f));
  }

  /// The final shape is a weighted mean of the runs': the weights do not depend on the quantity.
  void train_finals() {
    const Ridge ridge(components_, histories_.finals, histories_.trained_rows);
    std::vector<double> best;
    double chosen = 0;
    for (const double tried : ridges_) {
      std::vector<double> errors = mean_distances(ridge.left_out(tried), histories_.test_finals);
      if (!best.empty() && sum_of(errors) >= sum_of(best)) continue;
      best = std::move(errors);
      chosen = tried;
    }
    number(0) = bound_of(best, histories_.tested_runs);
    if (node_ == 0) return;
    const Index runs = components_.runs.rows();
    for (Index i = 0; i < runs; ++i)
      for (Index c = 0; c < kept(); ++c)
        trained_.runs[static_cast<std::size_t>(((node_ - 1) * runs + i) * most_components + c)] =
            static_cast<float>(components_.runs(i, c) / (components_.variances(c) + chosen));
  }

  void train_parameter(Index p) {
    const MatrixXd targets = histories_.parameters.col(p);
    const Ridge ridge(components_, targets, histories_.trained_rows);
    const VectorXd truth = histories_.test_parameters.col(p);
    std::vector<double> best;
    double chosen = 0, least = std::numeric_limits<double>::infinity();
    for (const double tried : ridges_) {
      const VectorXd errors = ridge.left_out(tried).col(0) - truth;
      double squares = 0;
      for (const double error : errors) squares += std::isfinite(error) ? error * error : 0;
      if (squares >= least) continue;
      least = squares;
      chosen = tried;
      best.assign(errors.begin(), errors.end());
    }
    number(1 + 2 * p) = node_ > 0 ? std::max(explained_share(best, truth), 0.0) : 0;
    number(2 + 2 * p) = bound_of(best, histories_.tested_runs);
    if (node_ == 0) return;
    const VectorXd weights = ridge.weights(chosen).col(0);
    for (Index c = 0; c < kept(); ++c)
      trained_.parameters[static_cast<std::size_t>(((node_ - 1) * histories_.parameters.cols() + p) * most_components +
                                                   c)] = static_cast<float>(weights(c));
  }

  const Histories& histories_;
  Index node_;
  TrainedForecast& trained_;
  RowVectorXd scales_;
  Components components_;
  std::vector<double> ridges_;
};

}  // namespace

TrainedForecast::TrainedForecast(std::size_t run_count, std::size_t parameter_count)
    : numbers((1 + LearnedForecast::nodes) * (1 + 2 * parameter_count), 0.0),
      means((1 + LearnedForecast::nodes * LearnedForecast::means_per_node) * LearnedForecast::shape_scores, 0.0f),
      components(LearnedForecast::nodes * LearnedForecast::most_components * LearnedForecast::features, 0.0f),
      runs(LearnedForecast::nodes * run_count * LearnedForecast::most_components, 0.0f),
      parameters(LearnedForecast::nodes * parameter_count * LearnedForecast::most_components, 0.0f) {}

TrainedForecast learn_forecast(const Histories& histories, unsigned threads) {
  TrainedForecast trained(static_cast<std::size_t>(histories.shapes.rows()),
                          static_cast<std::size_t>(histories.parameters.cols()));
  if (histories.shapes.rows() < fewest_runs || histories.tests.rows() == 0) return trained;
  for (Index i = 0; i < histories.means.size(); ++i)
    trained.means[static_cast<std::size_t>(i)] =
        static_cast<float>(histories.means(i / Histories::scores, i % Histories::scores));
  const RowVectorXd scales = scales_of(histories);
  work_in_parallel(static_cast<std::size_t>(1 + Histories::nodes), threads, [&](const auto& next) {
    for (std::size_t node = next(); node <= LearnedForecast::nodes; node = next())
      NodeTraining(histories, scales, static_cast<Index>(node), trained).train();
  });
  return trained;
}

TrainedForecast learn_forecast(const SampleSource& source, const LearnedFit& fit, const MatrixXd& parameters,
                               unsigned threads) {
  if (fit.tests.empty())
    return TrainedForecast(LearnedForecast::trained_runs(static_cast<std::uint32_t>(parameters.rows())),
                           static_cast<std::size_t>(parameters.cols()));
  return learn_forecast(read_histories(source, fit, parameters), threads);
}

}  // namespace lbea::bake
