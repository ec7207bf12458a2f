#include "precompute/forecast/forecast_training.hpp"

#include "precompute/dense/symmetric_eigenpairs.hpp"
#include "precompute/depth_images/learned_bounds.hpp"

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
  const MatrixXd& errors = histories.tests.front().errors;
  RowVectorXd variances = errors.colwise().squaredNorm() / static_cast<double>(errors.rows());
  for (Index node = 0; node < Histories::nodes; ++node) {
    auto of_node = variances.segment(node * Histories::scores, Histories::scores);
    const double floor = least *
                         histories.shapes.middleCols(node * Histories::scores, Histories::scores).squaredNorm() /
                         static_cast<double>(histories.shapes.rows());
    of_node = (0.5 * (of_node.array() + of_node.mean())).max(std::max(floor, 1e-30));
  }
  return variances.cwiseSqrt().cwiseInverse();
}

/// Principal components of the runs' shapes in a window, and the values of the runs.
struct Components {
  MatrixXd rows;       // components x features
  VectorXd variances;  // times the number of runs, descending
  MatrixXd runs;       // x components
};

/// From the rows' Gram matrix. shapes: scaled.
Components components_of(const MatrixXd& shapes) {
  const Eigenpairs pairs = eigenpairs_of_symmetric(shapes * shapes.transpose());
  const VectorXd& all = pairs.values;
  Index count = 0;
  while (count < all.size() && all(all.size() - 1 - count) > 1e-10 * all(all.size() - 1)) ++count;
  Components found;
  found.variances = all.tail(count).reverse();
  const MatrixXd vectors = pairs.vectors.rightCols(count).rowwise().reverse();
  const VectorXd lengths = found.variances.cwiseSqrt();
  found.rows = lengths.cwiseInverse().asDiagonal() * (vectors.transpose() * shapes);
  found.runs = vectors * lengths.asDiagonal();
  return found;
}

/// Ridge regression with a constant that is not penalized, for any ridge.
class Ridge {
 public:
  /// Keeps references.
  Ridge(const Components& components, const MatrixXd& targets)
      : components_(components),
        targets_(targets),
        mean_(targets.colwise().mean()),
        products_(components.runs.transpose() * (targets.rowwise() - mean_)) {}

  /// Components x targets: before a ridge divides them.
  [[nodiscard]] const MatrixXd& products() const noexcept { return products_; }
  /// Of tests, one row each, each by the regression without its own run. tests: x components. own: see
  /// Histories::Tests::trained_rows. With residual r and leverage h of that run, and the cross leverage g of run and
  /// test, it predicts g / (1 - h) r less than the regression with the run.
  [[nodiscard]] MatrixXd left_out(double ridge, const MatrixXd& tests, std::span<const Index> own) const {
    const VectorXd inverse = (components_.variances.array() + ridge).inverse();
    const MatrixXd weights = inverse.asDiagonal() * products_;
    MatrixXd predicted = (tests * weights).rowwise() + mean_;
    const double constant = 1 / static_cast<double>(targets_.rows());
    for (Index test = 0; test < predicted.rows(); ++test) {
      const Index run = own[static_cast<std::size_t>(test)];
      if (run == Histories::none) continue;
      const RowVectorXd of_run = components_.runs.row(run), weighed = of_run.cwiseProduct(inverse.transpose());
      const RowVectorXd residual = targets_.row(run) - mean_ - of_run * weights;
      const double h = constant + weighed.dot(of_run), g = constant + weighed.dot(tests.row(test));
      predicted.row(test) -= g / std::max(1 - h, 1e-9) * residual;
    }
    return predicted;
  }

 private:
  const Components& components_;
  const MatrixXd& targets_;
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

/// Of known errors.
double squares_of(std::span<const double> errors) {
  double squares = 0;
  for (const double error : errors) squares += std::isfinite(error) ? error * error : 0;
  return squares;
}

/// The ridge with the least error of the tests.
struct ChosenRidge {
  double ridge = 0, total = std::numeric_limits<double>::infinity();
  std::vector<double> errors{};  // per test

  void consider(double tried, std::vector<double> its_errors, double its_total) {
    if (errors.empty() || its_total < total) *this = {tried, its_total, std::move(its_errors)};
  }
};

/// Per target, by the squared errors. truth: tests x targets; NaN: not known.
std::vector<ChosenRidge> choose_ridges(const Ridge& regression, std::span<const double> ridges,
                                       const MatrixXd& of_tests, const MatrixXd& truth, std::span<const Index> own) {
  std::vector<ChosenRidge> best(static_cast<std::size_t>(truth.cols()));
  for (const double ridge : ridges) {
    const MatrixXd errors = regression.left_out(ridge, of_tests, own) - truth;
    for (Index target = 0; target < truth.cols(); ++target) {
      const auto of_target = errors.col(target);
      std::vector<double> values(of_target.begin(), of_target.end());
      const double total = squares_of(values);
      best[static_cast<std::size_t>(target)].consider(ridge, std::move(values), total);
    }
  }
  return best;
}

/// Two per channel: its values at a node, 0 being the impact, and at the end.
MatrixXd channel_targets(std::span<const MatrixXd> channels, Index rows, Index node) {
  MatrixXd targets(rows, 2 * std::ssize(channels));
  for (Index c = 0; c < std::ssize(channels); ++c) {
    targets.col(2 * c) = channels[static_cast<std::size_t>(c)].col(node);
    targets.col(2 * c + 1) = channels[static_cast<std::size_t>(c)].rightCols(1);
  }
  return targets;
}

class WindowTraining {
 public:
  /// row: that of the numbers, 1 + the window's; 0: nothing has been seen, and the window is not used.
  WindowTraining(const Histories& histories, const RowVectorXd& scales, std::size_t row, ForecastWindow window,
                 TrainedForecast& trained)
      : histories_(histories),
        row_(row),
        window_(window),
        trained_(trained),
        first_(row == 0 ? 0 : static_cast<Index>(window.first - 1) * Histories::scores),
        features_(row == 0 ? 0 : static_cast<Index>(window.size()) * Histories::scores),
        scales_(scales.segment(first_, features_)),
        components_(components_of(scaled(histories.shapes))),
        ridges_(row == 0 ? std::vector<double>{1} : ridges_for(components_.variances)),
        finals_(components_, histories.finals),
        parameters_(components_, histories.parameters),
        channel_values_(targets_of(histories.channels, histories.shapes.rows())),
        channels_(components_, channel_values_) {}

  void train() {
    if (row_ > 0) write_window();
    for (std::size_t kind = 0; kind < LearnedForecast::kinds; ++kind) {
      // Without tests that have a hidden part, those without.
      const Histories::Tests& tests = histories_.tests[histories_.tests[kind].shapes.rows() > 0 ? kind : 0];
      const MatrixXd of_tests = scaled(tests.shapes) * components_.rows.transpose();
      train_finals(kind, tests, of_tests);
      train_parameters(kind, tests, of_tests);
      train_channels(kind, tests, of_tests);
    }
  }

 private:
  [[nodiscard]] MatrixXd scaled(const MatrixXd& shapes) const {
    return shapes.middleCols(first_, features_) * scales_.asDiagonal();
  }
  [[nodiscard]] MatrixXd targets_of(std::span<const MatrixXd> channels, Index rows) const {
    return channel_targets(channels, rows, row_ == 0 ? 0 : static_cast<Index>(window_.last));
  }
  [[nodiscard]] Index kept() const { return std::min<Index>(components_.variances.size(), most_components); }
  [[nodiscard]] double& number(std::size_t kind, Index i) {
    const auto per_row = LearnedForecast::numbers_per_window(static_cast<std::size_t>(histories_.parameters.cols()));
    return trained_.numbers[(kind * (1 + ForecastWindow::count) + row_) * per_row + static_cast<std::size_t>(i)];
  }

  void write_window() {
    const std::size_t most = LearnedForecast::most_components, window = window_.number();
    const auto runs = static_cast<std::size_t>(components_.runs.rows());
    float* rows = &trained_.components[window_.sizes_before() * most * LearnedForecast::shape_scores];
    for (Index c = 0; c < kept(); ++c) {
      const auto at = static_cast<std::size_t>(c);
      trained_.variances[window * most + at] = static_cast<float>(components_.variances(c));
      for (Index f = 0; f < features_; ++f) *rows++ = static_cast<float>(components_.rows(c, f) * scales_(f));
      for (std::size_t run = 0; run < runs; ++run)
        trained_.runs[(window * runs + run) * most + at] =
            static_cast<float>(components_.runs(static_cast<Index>(run), c));
    }
    write_products(parameters_.products(), trained_.parameters);
    write_products(channels_.products(), trained_.channel_products);
  }
  /// products: components x targets. into: windows x targets x most_components.
  void write_products(const MatrixXd& products, std::vector<float>& into) const {
    for (Index target = 0; target < products.cols(); ++target) {
      const auto row = window_.number() * static_cast<std::size_t>(products.cols()) + static_cast<std::size_t>(target);
      for (Index c = 0; c < kept(); ++c)
        into[row * LearnedForecast::most_components + static_cast<std::size_t>(c)] =
            static_cast<float>(products(c, target));
    }
  }

  /// The final shape is a weighted mean of the runs': the weights do not depend on the quantity.
  void train_finals(std::size_t kind, const Histories::Tests& tests, const MatrixXd& of_tests) {
    ChosenRidge best;
    for (const double ridge : ridges_) {
      std::vector<double> errors = mean_distances(finals_.left_out(ridge, of_tests, tests.trained_rows), tests.finals);
      const double total = sum_of(errors);
      best.consider(ridge, std::move(errors), total);
    }
    number(kind, 0) = bound_of(best.errors, tests.runs);
    number(kind, 1) = best.ridge;
  }

  void train_parameters(std::size_t kind, const Histories::Tests& tests, const MatrixXd& of_tests) {
    const auto chosen = choose_ridges(parameters_, ridges_, of_tests, tests.parameters, tests.trained_rows);
    for (Index p = 0; p < tests.parameters.cols(); ++p) {
      const ChosenRidge& best = chosen[static_cast<std::size_t>(p)];
      number(kind, 2 + 3 * p) = row_ > 0 ? std::max(explained_share(best.errors, tests.parameters.col(p)), 0.0) : 0;
      number(kind, 3 + 3 * p) = bound_of(best.errors, tests.runs);
      number(kind, 4 + 3 * p) = best.ridge;
    }
  }

  void train_channels(std::size_t kind, const Histories::Tests& tests, const MatrixXd& of_tests) {
    const MatrixXd truth = targets_of(tests.channels, tests.shapes.rows());
    const auto chosen = choose_ridges(channels_, ridges_, of_tests, truth, tests.trained_rows);
    const std::size_t row = kind * (1 + ForecastWindow::count) + row_;
    for (std::size_t target = 0; target < chosen.size(); ++target) {
      double* numbers = &trained_.channel_numbers[2 * (row * chosen.size() + target)];
      numbers[0] = bound_of(chosen[target].errors, tests.runs);
      numbers[1] = chosen[target].ridge;
    }
  }

  const Histories& histories_;
  std::size_t row_;
  ForecastWindow window_;
  TrainedForecast& trained_;
  Index first_, features_;
  RowVectorXd scales_;
  Components components_;
  std::vector<double> ridges_;
  Ridge finals_, parameters_;
  MatrixXd channel_values_;  // of the runs
  Ridge channels_;
};

}  // namespace

TrainedForecast::TrainedForecast(std::size_t run_count, std::size_t parameter_count, std::size_t channel_count)
    : numbers(
          LearnedForecast::kinds * (1 + ForecastWindow::count) * LearnedForecast::numbers_per_window(parameter_count),
          0.0),
      means((1 + LearnedForecast::nodes * LearnedForecast::means_per_node) * LearnedForecast::shape_scores, 0.0f),
      components(LearnedForecast::all_sizes * LearnedForecast::most_components * LearnedForecast::shape_scores, 0.0f),
      variances(ForecastWindow::count * LearnedForecast::most_components, 0.0f),
      runs(ForecastWindow::count * run_count * LearnedForecast::most_components, 0.0f),
      parameters(ForecastWindow::count * parameter_count * LearnedForecast::most_components, 0.0f),
      channel_numbers(
          LearnedForecast::kinds * (1 + ForecastWindow::count) * LearnedForecast::numbers_per_channel * channel_count,
          0.0),
      channel_products(ForecastWindow::count * LearnedForecast::values_per_channel * channel_count *
                           LearnedForecast::most_components,
                       0.0f) {}

TrainedForecast learn_forecast(const Histories& histories, const Workers& workers) {
  TrainedForecast trained(static_cast<std::size_t>(histories.shapes.rows()),
                          static_cast<std::size_t>(histories.parameters.cols()), histories.channels.size());
  if (histories.shapes.rows() < fewest_runs || histories.tests.front().shapes.rows() == 0) return trained;
  for (Index i = 0; i < histories.means.size(); ++i)
    trained.means[static_cast<std::size_t>(i)] =
        static_cast<float>(histories.means(i / Histories::scores, i % Histories::scores));
  const RowVectorXd scales = scales_of(histories);
  std::vector<ForecastWindow> rows{{}};  // of the numbers; the first one is not a window's
  for (std::size_t first = 1; first <= LearnedForecast::nodes; ++first)
    for (std::size_t last = first; last <= LearnedForecast::nodes; ++last) rows.push_back({first, last});
  work_in_parallel(rows.size(), workers, [&](const auto& next) {
    for (std::size_t row = next(); row < rows.size(); row = next())
      WindowTraining(histories, scales, row, rows[row], trained).train();
  });
  return trained;
}

TrainedForecast learn_forecast(const SampleSource& source, const LearnedFit& fit, const MatrixXd& parameters,
                               const Workers& workers) {
  if (fit.tests.empty())
    return TrainedForecast(LearnedForecast::trained_runs(static_cast<std::uint32_t>(parameters.rows())),
                           static_cast<std::size_t>(parameters.cols()),
                           source.channels.size() / std::max<std::size_t>(source.samples.size(), 1));
  return learn_forecast(read_histories(source, fit, parameters), workers);
}

}  // namespace lbea::bake
