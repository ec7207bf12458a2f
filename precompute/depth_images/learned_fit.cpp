#include "precompute/depth_images/learned_fit.hpp"

#include "precompute/depth_images/learned_bounds.hpp"
#include "precompute/left_out/left_out_tests.hpp"
#include "precompute/left_out/sample_cache.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::bake {
namespace {

constexpr std::size_t most_matched = 192, most_compared = 1024;  // frames
constexpr std::size_t most_hidden = 576;                         // frames: a hidden part makes errors vary more
constexpr std::size_t most_tests = 100, most_hidden_tests = 50;  // runs
constexpr std::size_t least_priced_runs = 20;                    // of ten, learned prices changed the errors by 0.3 %
constexpr double hidden_by_a_patch = 0.3;                        // share of the cells

/// Shape scores of the frames' estimates, one row each. shapes: those of all samples.
Eigen::MatrixXd combinations(std::span<const FrameErrors> frames, const Eigen::MatrixXd& shapes) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(std::ssize(frames), shapes.cols());
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (const auto& [sample, weight] : frames[i].weights)
      rows.row(static_cast<Eigen::Index>(i)) += double{weight} * shapes.row(static_cast<Eigen::Index>(sample));
  return rows;
}

/// The estimates' shape scores.
std::vector<EstimatedShape> estimated_shapes(std::span<const FrameErrors> frames, const ShapeRegression& regression) {
  std::vector<EstimatedShape> shapes;
  for (const FrameErrors& frame : frames) {
    EstimatedShape& shape = shapes.emplace_back(EstimatedShape{frame.sample, {}});
    for (const auto& [sample, weight] : frame.weights)
      for (std::size_t i = 0; i < shape.scores.size(); ++i) shape.scores[i] += weight * regression.shape(sample)[i];
  }
  return shapes;
}

/// How far the estimate goes to the prediction: the share with the least mean error, and 98 % of the differences.
struct Blend {
  float share = 0, most_difference = 0;
};
Blend learn_blend(const Eigen::MatrixXd& combined, const Eigen::MatrixXd& predicted, const Eigen::MatrixXd& truth) {
  const Eigen::MatrixXd moves = predicted - combined;
  const auto error = [&](double share) { return (combined + share * moves - truth).rowwise().norm().sum(); };
  const auto share = std::ranges::min(std::array{0.0, 0.125, 0.25, 0.375, 0.5, 0.625, 0.75, 0.875, 1.0}, {}, error);
  const Eigen::VectorXd norms = moves.rowwise().norm();
  std::vector<double> differences(norms.begin(), norms.end());
  std::ranges::sort(differences);
  return {static_cast<float>(share), static_cast<float>(differences[differences.size() * 49 / 50])};
}

/// Frames of whole tests.
struct TestFrames {
  const LeftOutTests &seen, &hidden;
  std::vector<FrameErrors> of_hidden;  // without the regression
};

/// Trains the regression, and finds how much the estimates follow it. of_whole, of_hidden: the frames' estimates
/// without it. Returns its predictions for the whole frames, for the hidden ones, then for those of the tests.
Eigen::MatrixXd train_shapes(const SampleSource& source, const LeftOutTests& whole, const LeftOutTests& hidden,
                             const TestFrames& tests, std::span<const FrameErrors> of_whole,
                             std::span<const FrameErrors> of_hidden, const DepthMetric& metric, const Workers& workers,
                             TrainedShapes& trained) {
  ShapeTraining training(source, metric);
  std::vector<CompletedFrame> completed;
  const auto add_completed = [&](const LeftOutTests& of, std::span<const FrameErrors> errors) {
    for (std::size_t i = 0; i < errors.size(); ++i) completed.push_back({of.frames().sample(i), errors[i].completed});
  };
  add_completed(hidden, of_hidden);
  for (std::size_t i = 0; i < tests.seen.frames().size(); ++i)
    completed.push_back({tests.seen.frames().sample(i), tests.seen.frames().observed(i)});
  add_completed(tests.hidden, tests.of_hidden);
  Eigen::MatrixXd predicted = training.predict_left_out(whole.frames(), workers, completed);
  const auto blend = [&](const LeftOutTests& of, std::span<const FrameErrors> errors, const auto& rows) {
    Eigen::MatrixXd truth(rows.rows(), rows.cols());
    for (std::size_t i = 0; i < errors.size(); ++i)
      truth.row(static_cast<Eigen::Index>(i)) = training.shapes().row(static_cast<Eigen::Index>(of.frames().sample(i)));
    return learn_blend(combinations(errors, training.shapes()), rows, truth);
  };
  const Blend by_whole = blend(whole, of_whole, predicted.topRows(std::ssize(of_whole)));
  const Blend by_hidden = blend(hidden, of_hidden, predicted.middleRows(std::ssize(of_whole), std::ssize(of_hidden)));
  trained = training.train();
  trained.blend = by_whole.share;
  trained.most_difference = by_whole.most_difference;
  trained.hidden_blend = by_whole.share > 0 ? by_hidden.share : 0;
  trained.hidden_most_difference = by_hidden.most_difference;
  return predicted;
}

/// See DepthImages::time_variation. Late frames, whose times vary most, count most.
float time_variation(const SampleSource& source, std::span<const FrameErrors> errors) {
  const double impact = std::ranges::min(source.samples, {}, &Sample::time_step).time_step;
  double squares = 0, all = 0;
  for (const FrameErrors& error : errors) {
    const double time = source.samples[error.sample].time_step - impact, estimate = error.time_step - impact;
    squares += (estimate - time) * (estimate - time);
    all += time * time;
  }
  return all > 0 ? static_cast<float>(std::sqrt(squares / all)) : 0;
}

/// Frames of tests, whole and hidden.
using FramePair = std::array<std::vector<FrameErrors>, LearnedChannels::kinds>;

/// predicted: its last rows are those of the tests.
FramePair learn_tests(const LeftOutTests& seen, const LeftOutTests& hidden, const ShapeRegression& regression,
                      const Eigen::MatrixXd& predicted, LearnedFit& learned) {
  const auto of_seen = static_cast<Eigen::Index>(seen.frames().size()),
             of_hidden = static_cast<Eigen::Index>(hidden.frames().size());
  FramePair frames{
      seen.published_errors(0, learned.costs, regression, regression.blend,
                            predicted.middleRows(predicted.rows() - of_hidden - of_seen, of_seen)),
      hidden.published_errors(0, learned.costs, regression, regression.hidden_blend, predicted.bottomRows(of_hidden))};
  learned.tests = estimated_shapes(frames[0], regression);
  learned.hidden_tests = estimated_shapes(frames[1], regression);
  return frames;
}

/// frames: whole, hidden.
void learn_channels(const SampleSource& source, const FramePair& frames, LearnedFit& learned) {
  const std::array error_bounds{learned.error_bound, learned.hidden_error_bound};
  for (std::size_t first = 0; first < source.channels.size(); first += source.samples.size()) {
    const auto values = std::span(source.channels).subspan(first, source.samples.size());
    auto& bounds = learned.channels.emplace_back();
    for (std::size_t kind = 0; kind < bounds.size(); ++kind)
      bounds[kind] = learn_channel_bound(values, frames[kind], error_bounds[kind]);
  }
}

void append(std::vector<FrameErrors>& to, const std::vector<FrameErrors>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Of samples as frames: the residual that the best sample of the other simulations leaves.
std::vector<LeftOut> left_out_residuals(const SampleSource& source, const DepthMetric& metric, const Workers& workers) {
  const DepthCamera& camera = source.camera;
  const CellPrices prices = prices_of(metric, camera);
  const LeftOutFrames frames(source, most_compared, 0);
  const auto best = best_of_others(source, frames, std::span(&metric, 1), 1, workers);
  std::vector<LeftOut> answers;
  std::vector<std::uint16_t> image(padded_cells(camera));
  std::vector<float> residuals(image.size());
  for (std::size_t frame = 0; frame < frames.size(); ++frame) {
    source.read_images(best[frame].ranked()[0].sample, image);
    const float square = tolerant_residuals(kernels(), camera, prices, frames.observed(frame), image, residuals);
    answers.push_back({source.samples[frames.sample(frame)], square * camera.depth_step * camera.depth_step});
  }
  return answers;
}

void learn_limits(const SampleSource& source, const Workers& workers, LearnedFit& learned) {
  const std::vector<LeftOut> answers = left_out_residuals(source, learned.costs.metric, workers);
  const ExpectedResiduals expected(answers);
  std::ranges::transform(source.samples, learned.expected.begin(),
                         [&](const Sample& sample) { return expected.at(sample.time_step); });
  learned.limits = misfit_limits(answers, expected, learned.costs.metric.mesh_noise);
}

/// What an ensemble of one simulation has.
LearnedFit not_learned(const SampleSource& source) {
  return {.costs = {DepthMetric{}.in(source.length_unit)},
          .expected = std::vector<float>(source.samples.size(), 0.0f),
          .bounds = std::vector<SpreadBound>(source.read_field ? 1 + source.fields : 0),
          .shapes = TrainedShapes::untrained(source.camera, source.samples.size())};
}

/// Errors of the estimates as the runtime publishes them.
struct PublishedErrors {
  std::vector<FrameErrors> whole, hidden;
  FramePair tests;
};

/// Those that change the estimates and that the bake learns.
std::vector<float EstimatePrices::*> prices_in_use(const SampleSource& source, const ShapeRegression& regression) {
  std::vector<float EstimatePrices::*> prices;
  if (regression.blend > 0) prices.push_back(&EstimatePrices::neighbor);
  if (source.points_of) prices.push_back(&EstimatePrices::correction);
  return prices;
}

/// Learns the metric, the prices, the regression and what the tests look like.
PublishedErrors learn_estimates(const SampleSource& source, const Workers& workers, LearnedFit& learned) {
  const std::vector<DepthMetric> metrics = metrics_in(source.length_unit);
  const LeftOutTests whole(source, metrics, most_matched, 0, workers);
  const LeftOutTests same_hidden(source, metrics, most_matched, hidden_by_a_patch, workers);
  const auto best = choose_metric(whole, same_hidden);
  const std::size_t metric = best.first;
  const std::vector<FrameErrors>& of_whole = best.second;
  FitCosts& costs = learned.costs;
  costs = {metrics[metric], source.prices.value_or(EstimatePrices{})};
  const std::span chosen(&metrics[metric], 1);
  const LeftOutTests hidden(source, chosen, most_hidden, hidden_by_a_patch, workers);
  const std::vector<FrameErrors> of_hidden = learn_hidden_price(hidden, costs);
  const LeftOutTests seen_tests(source, chosen, samples_of_tests(source, most_tests), 0, workers);
  const LeftOutTests hidden_tests(source, chosen, samples_of_tests(source, most_hidden_tests), hidden_by_a_patch,
                                  workers, HiddenPlace::of_run);
  const Eigen::MatrixXd predicted =
      train_shapes(source, whole, hidden, {seen_tests, hidden_tests, hidden_tests.errors(0, costs)}, of_whole,
                   of_hidden, costs.metric, workers, learned.shapes);
  const ShapeRegression regression = learned.shapes.view();
  const auto rows = [&](std::size_t first, std::size_t count) {
    return predicted.middleRows(static_cast<Eigen::Index>(first), static_cast<Eigen::Index>(count));
  };
  const auto publish = [&](const FitCosts& tried, std::size_t every_hidden) -> PublishedErrors {
    return {whole.published_errors(metric, tried, regression, regression.blend, rows(0, of_whole.size())),
            hidden.published_errors(0, tried, regression, regression.hidden_blend,
                                    rows(of_whole.size(), of_hidden.size()), every_hidden),
            {}};
  };
  const auto errors_by = [&](const EstimatePrices& prices) {
    const std::size_t as_many_as_whole = std::max<std::size_t>(of_hidden.size() / of_whole.size(), 1);
    PublishedErrors errors = publish({costs.metric, prices}, as_many_as_whole);
    append(errors.whole, errors.hidden);
    return errors.whole;
  };
  if (!source.prices && samples_of_runs(source.samples).size() >= least_priced_runs)
    learn_prices(prices_in_use(source, regression), errors_by, costs.prices);
  PublishedErrors errors = publish(costs, 1);
  if (regression.blend > 0) errors.tests = learn_tests(seen_tests, hidden_tests, regression, predicted, learned);
  return errors;
}

bool is_one_simulation(std::span<const Sample> samples) {
  return samples.empty() || samples.front().simulation == samples.back().simulation;
}

}  // namespace

LearnedFit learn_fit(const SampleSource& samples, const Workers& workers) {
  const SampleSource source = with_cache(samples);
  LearnedFit learned = not_learned(source);
  if (is_one_simulation(source.samples)) {
    learned.channels.resize(source.channels.size() / std::max<std::size_t>(source.samples.size(), 1));
    return learned;
  }
  const PublishedErrors errors = learn_estimates(source, workers, learned);
  FramePair all = errors.tests;
  append(all[0], errors.whole);
  append(all[1], errors.hidden);
  const double least = 1e-3 * double{learned.costs.metric.mesh_noise};  // spread; below it the shapes are all the same
  learned.error_bound = learn_error_bound(all[0], least);
  learned.hidden_error_bound = learn_error_bound(all[1], least);
  if (source.read_field)
    learned.bounds =
        learn_bounds(source, {errors.whole, learned.error_bound}, {errors.hidden, learned.hidden_error_bound}, workers);
  learned.time_variation = time_variation(source, errors.whole);
  learn_channels(source, all, learned);
  learned.pose = learn_pose(source, learned.costs, workers);
  learn_limits(source, workers, learned);
  return learned;
}

}  // namespace lbea::bake
