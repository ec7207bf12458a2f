#include "precompute/forecast/histories.hpp"

#include "precompute/left_out/branches.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <cmath>

namespace lbea::bake {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::RowVectorXd;

constexpr Index per_node = LearnedForecast::means_per_node;
constexpr std::size_t most_nodes = 128;  // of the mesh, at which final shapes are compared

class HistoryReader {
 public:
  HistoryReader(const SampleSource& source, const LearnedFit& fit)
      : source_(source), fit_(fit), runs_(samples_of_runs(source.samples)), times_(source.times) {
    const auto count = static_cast<std::uint32_t>(runs_.size());
    for (std::size_t i = 0; i < LearnedForecast::trained_runs(count); ++i)
      trained_.push_back(LearnedForecast::trained_run(i, count));
    clock_error_ = clock_error();
  }

  Histories read(const MatrixXd& parameters) {
    Histories histories;
    read_means(histories);
    read_runs(parameters, histories);
    histories.tests = {tests_of(fit_.tests, parameters, histories), tests_of(fit_.hidden_tests, parameters, histories)};
    return histories;
  }

 private:
  [[nodiscard]] RowVectorXd stored(std::size_t sample) const {
    constexpr auto size = static_cast<std::size_t>(Histories::scores);
    return Eigen::Map<const Eigen::RowVectorXf>(&fit_.shapes.shapes[sample * size], Histories::scores).cast<double>();
  }
  /// Between two samples shapes change linearly.
  [[nodiscard]] RowVectorXd shape(std::size_t run, double node) const {
    const auto [before, share] = runs_[run].place_of(source_.times, times_.at(node));
    if (share == 0) return stored(before);
    return (1 - share) * stored(before) + share * stored(before + 1);
  }
  /// late: how much later than a node its shape is taken, in nodes.
  [[nodiscard]] RowVectorXd deviations(const MatrixXd& means, std::size_t run, double late = 0) const {
    RowVectorXd row(Histories::nodes * Histories::scores);
    for (Index node = 0; node < Histories::nodes; ++node)
      row.segment(node * Histories::scores, Histories::scores) =
          shape(run, static_cast<double>(node + 1) + late) - means.row((node + 1) * per_node);
    return row;
  }
  [[nodiscard]] RowVectorXd final_positions(std::size_t run) const {
    std::vector<float> positions(3 * source_.nodes);
    source_.read_positions(runs_[run].first + runs_[run].count - 1, positions);
    const std::vector<float> some = thinned_nodes(positions, most_nodes);
    return Eigen::Map<const Eigen::RowVectorXf>(some.data(), std::ssize(some)).cast<double>();
  }

  [[nodiscard]] std::size_t channels() const { return source_.channels.size() / source_.samples.size(); }
  /// At the impact and at the nodes.
  [[nodiscard]] RowVectorXd channel_values(std::size_t channel, std::size_t run) const {
    const auto values = std::span(source_.channels).subspan(channel * source_.samples.size(), source_.samples.size());
    RowVectorXd row(1 + Histories::nodes);
    for (Index node = 0; node <= Histories::nodes; ++node) {
      const auto [before, share] = runs_[run].place_of(source_.times, times_.at(static_cast<double>(node)));
      row(node) = double{values[before]};
      if (share > 0) row(node) += share * (double{values[before + 1]} - double{values[before]});
    }
    return row;
  }

  void read_means(Histories& histories) const {
    histories.means = MatrixXd::Zero(1 + Histories::nodes * per_node, Histories::scores);
    for (Index i = 0; i < histories.means.rows(); ++i) {
      for (const std::size_t run : trained_)
        histories.means.row(i) += shape(run, static_cast<double>(i) / static_cast<double>(per_node));
      histories.means.row(i) /= static_cast<double>(trained_.size());
    }
  }

  void read_runs(const MatrixXd& parameters, Histories& histories) const {
    const Index count = std::ssize(trained_);
    histories.shapes.resize(count, Histories::nodes * Histories::scores);
    histories.parameters.resize(count, parameters.cols());
    histories.channels.assign(channels(), MatrixXd(count, 1 + Histories::nodes));
    for (Index i = 0; i < count; ++i) {
      const std::size_t run = trained_[static_cast<std::size_t>(i)];
      histories.shapes.row(i) = deviations(histories.means, run);
      const RowVectorXd last = final_positions(run);
      histories.finals.conservativeResize(count, last.size());
      histories.finals.row(i) = last;
      histories.parameters.row(i) = parameters.row(static_cast<Index>(run));
      for (std::size_t c = 0; c < channels(); ++c) histories.channels[c].row(i) = channel_values(c, run);
    }
    for (auto column : histories.parameters.colwise()) {
      double sum = 0, given = 0;
      for (const double value : column)
        if (std::isfinite(value)) sum += value, ++given;
      for (double& value : column)
        if (!std::isfinite(value)) value = sum / std::max(given, 1.0);
    }
  }

  [[nodiscard]] Histories::Tests tests_of(std::span<const EstimatedShape> estimates, const MatrixXd& parameters,
                                          const Histories& histories) const {
    Histories::Tests tests;
    const Index runs = std::ssize(estimates) / Histories::nodes, count = 2 * runs;
    tests.runs = static_cast<std::size_t>(runs);
    tests.errors.resize(count, Histories::nodes * Histories::scores);
    tests.shapes.resize(count, Histories::nodes * Histories::scores);
    tests.finals.resize(count, histories.finals.cols());
    tests.parameters.resize(count, parameters.cols());
    tests.channels.assign(channels(), MatrixXd(count, 1 + Histories::nodes));
    for (Index i = 0; i < runs; ++i) {
      const auto of_run = estimates.subspan(static_cast<std::size_t>(i * Histories::nodes), Histories::nodes);
      const std::size_t run = source_.samples[of_run.front().sample].simulation;
      const RowVectorXd truth = deviations(histories.means, run), error = errors(of_run), last = final_positions(run);
      const auto own = std::ranges::find(trained_, run);
      for (const Index row : {2 * i, 2 * i + 1}) {
        tests.shapes.row(row) = deviations(histories.means, run, row % 2 == 0 ? clock_error_ : -clock_error_) + error;
        tests.errors.row(row) = tests.shapes.row(row) - truth;
        tests.finals.row(row) = last;
        tests.parameters.row(row) = parameters.row(static_cast<Index>(run));
        for (std::size_t c = 0; c < channels(); ++c) tests.channels[c].row(row) = channel_values(c, run);
        tests.trained_rows.push_back(own == trained_.end() ? Histories::none : own - trained_.begin());
      }
    }
    return tests;
  }
  /// Of the estimates of the samples nearest to the nodes, one test. They are as wrong at the nodes.
  [[nodiscard]] RowVectorXd errors(std::span<const EstimatedShape> test) const {
    RowVectorXd row(Histories::nodes * Histories::scores);
    for (Index node = 0; node < Histories::nodes; ++node) {
      const EstimatedShape& estimate = test[static_cast<std::size_t>(node)];
      row.segment(node * Histories::scores, Histories::scores) =
          Eigen::Map<const Eigen::RowVectorXf>(estimate.scores.data(), Histories::scores).cast<double>() -
          stored(estimate.sample);
    }
    return row;
  }
  /// A test's clock is wrong by about a third of the interval between states, root mean square; in nodes.
  [[nodiscard]] double clock_error() const {
    const double states = static_cast<double>(source_.samples.size());
    const double interval = times_.duration_s * static_cast<double>(runs_.size()) / states;
    return times_.duration_s > 0 ? interval / 3 / times_.duration_s * static_cast<double>(Histories::nodes) : 0;
  }

  const SampleSource& source_;
  const LearnedFit& fit_;
  std::vector<RunSamples> runs_;
  ForecastTimes times_;
  std::vector<std::size_t> trained_;  // runs
  double clock_error_ = 0;            // in nodes
};

}  // namespace

Histories read_histories(const SampleSource& source, const LearnedFit& fit, const MatrixXd& parameters) {
  return HistoryReader(source, fit).read(parameters);
}

}  // namespace lbea::bake
