#include "precompute/depth_images/learned_fit.hpp"

#include "precompute/depth_images/learned_bounds.hpp"
#include "precompute/depth_images/sample_cache.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/forecast/learned_forecast.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>

namespace lbea::bake {
namespace {

constexpr std::size_t most_matched = 192, most_compared = 1024;        // frames
constexpr std::size_t most_hidden = 576;                               // frames: a hidden part makes errors vary more
constexpr double hidden_by_a_patch = 0.3;                              // share of the cells
constexpr std::uint32_t most_neighbors = 2 * FitSettings{}.neighbors;  // proposed for the estimate of a left-out frame

/// Frames of left-out runs, seen completely or with a part hidden, and their candidates by each metric.
class LeftOutTests {
 public:
  LeftOutTests(const SampleSource& source, std::span<const DepthMetric> metrics, std::size_t most, double hidden,
               unsigned threads)
      : LeftOutTests(source, metrics, spread_samples(std::min(most, source.samples.size()), source.samples.size()),
                     hidden, threads) {}
  LeftOutTests(const SampleSource& source, std::span<const DepthMetric> metrics, std::vector<std::size_t> samples,
               double hidden, unsigned threads, HiddenPlace place = HiddenPlace::of_frame)
      : source_(source),
        metrics_(metrics),
        threads_(threads),
        is_hidden_(hidden > 0),
        frames_(source, std::move(samples), hidden,
                is_hidden_ ? 0 : metrics.front().mesh_noise / source.camera.depth_step, place),
        best_(best_of_others(source, frames_, metrics, proposed(), threads)) {}

  [[nodiscard]] const LeftOutFrames& frames() const noexcept { return frames_; }
  [[nodiscard]] std::vector<FrameErrors> errors(std::size_t metric) const { return errors(metric, metrics_[metric]); }
  /// As the runtime publishes estimates: they follow the regression if `blend`, its share, is not 0, and are moved to
  /// the points.
  [[nodiscard]] std::vector<FrameErrors> published_errors(std::size_t metric, const DepthMetric& costs,
                                                          const ShapeRegression& regression, float blend,
                                                          const Eigen::MatrixXd& predicted) const {
    return blend > 0 ? errors(metric, costs, regression, predicted, true) : errors(metric, costs, {}, {}, true);
  }
  /// costs: those of the metric, with any price of hidden parts. predicted: one row of shape scores per frame; without
  /// rows, the candidates alone determine the estimates. corrects: see LeftOutFitter::errors().
  [[nodiscard]] std::vector<FrameErrors> errors(std::size_t metric, const DepthMetric& costs,
                                                const ShapeRegression& regression = {},
                                                const Eigen::MatrixXd& predicted = {}, bool corrects = false) const {
    const bool is_predicted = predicted.rows() > 0;
    std::vector<FrameErrors> errors(frames_.size());
    work_in_parallel(frames_.size(), threads_, [&](const auto& next) {
      LeftOutFitter fitter(source_, costs, proposed() + (is_predicted ? most_neighbors : 0), regression);
      for (std::size_t i = next(); i < frames_.size(); i = next()) {
        LeftOutFrame left_out(frames_, i, best_[metric * frames_.size() + i], is_hidden_);
        if (is_predicted) add_prediction(regression, predicted.row(static_cast<Eigen::Index>(i)), left_out);
        errors[i] = fitter.errors(left_out, nullptr, corrects);
      }
    });
    return errors;
  }

 private:
  /// By what a frame shows. Where something hides a part, that proposes samples of which only some are good.
  [[nodiscard]] std::uint32_t proposed() const noexcept {
    return is_hidden_ ? DepthRanking::most_promising : FitSettings{}.candidates;
  }
  /// Proposes the samples of other simulations nearest to the prediction, too.
  void add_prediction(const ShapeRegression& regression, const Eigen::RowVectorXd& scores, LeftOutFrame& frame) const {
    const Eigen::RowVectorXf rounded = scores.cast<float>();
    frame.predicted.assign(rounded.begin(), rounded.end());
    BestSamples nearest(most_neighbors);
    for (std::uint32_t s = 0; s < source_.samples.size(); ++s)
      if (source_.samples[s].simulation != source_.samples[frame.sample].simulation &&
          std::ranges::find(frame.proposed, s) == frame.proposed.end())
        nearest.offer(s, squared_distance(regression.shape(s), frame.predicted));
    for (const RankedSample& one : nearest.ranked()) frame.proposed.push_back(one.sample);
  }

  const SampleSource& source_;
  std::span<const DepthMetric> metrics_;
  unsigned threads_;
  bool is_hidden_;
  LeftOutFrames frames_;
  std::vector<BestSamples> best_;
};

/// Shape scores of the frames' estimates, one row each. shapes: those of all samples.
Eigen::MatrixXd combinations(std::span<const FrameErrors> frames, const Eigen::MatrixXd& shapes) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Zero(std::ssize(frames), shapes.cols());
  for (std::size_t i = 0; i < frames.size(); ++i)
    for (const auto& [sample, weight] : frames[i].weights)
      rows.row(static_cast<Eigen::Index>(i)) += double{weight} * shapes.row(static_cast<Eigen::Index>(sample));
  return rows;
}

constexpr std::size_t most_tests = 100, most_hidden_tests = 50;  // runs

/// The samples at the times of the forecast, of `most` left-out runs spread over the ensemble.
std::vector<std::size_t> samples_of_tests(const SampleSource& source, std::size_t most) {
  const std::vector<RunSamples> runs = samples_of_runs(source.samples);
  std::vector<std::size_t> chosen;
  if (source.times.empty()) return chosen;
  const ForecastTimes times(source.times);
  for (const std::size_t run : spread_samples(std::min(most, runs.size()), runs.size()))
    for (std::size_t node = 1; node <= LearnedForecast::nodes; ++node)
      chosen.push_back(runs[run].nearest(source.times, times.at(static_cast<double>(node))));
  return chosen;
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
                             std::span<const FrameErrors> of_hidden, const DepthMetric& costs, unsigned threads,
                             TrainedShapes& trained) {
  ShapeTraining training(source, costs);
  std::vector<CompletedFrame> completed;
  const auto add_completed = [&](const LeftOutTests& of, std::span<const FrameErrors> errors) {
    for (std::size_t i = 0; i < errors.size(); ++i) completed.push_back({of.frames().sample(i), errors[i].completed});
  };
  add_completed(hidden, of_hidden);
  for (std::size_t i = 0; i < tests.seen.frames().size(); ++i)
    completed.push_back({tests.seen.frames().sample(i), tests.seen.frames().observed(i)});
  add_completed(tests.hidden, tests.of_hidden);
  Eigen::MatrixXd predicted = training.predict_left_out(whole.frames(), threads, completed);
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

/// The default first. High costs distinguish large deformations; with low costs a fold that lies a few millimeters
/// elsewhere costs little.
std::vector<DepthMetric> metrics_in(std::string_view length_unit) {
  std::vector<DepthMetric> metrics;
  for (const float scale : {1.0f, 0.25f, 0.5f, 2.0f, 4.0f}) {
    DepthMetric metric = DepthMetric{}.in(length_unit);
    metric.cap *= scale;
    metric.one_sided *= scale;
    metric.hidden *= scale;
    metrics.push_back(metric);
  }
  return metrics;
}

double total(std::span<const FrameErrors> errors) {
  double sum = 0;
  for (const FrameErrors& error : errors) sum += error.estimate + error.match;
  return sum;
}

/// The metric with the least errors of whole and hidden frames, and those of the whole ones.
std::pair<std::size_t, std::vector<FrameErrors>> choose_metric(const SampleSource& source, const LeftOutTests& whole,
                                                               std::span<const DepthMetric> metrics, unsigned threads) {
  const LeftOutTests hidden(source, metrics, most_matched, hidden_by_a_patch, threads);
  std::pair<std::size_t, std::vector<FrameErrors>> best;
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t m = 0; m < metrics.size(); ++m) {
    std::vector<FrameErrors> errors = whole.errors(m);
    const double sum = total(errors) + total(hidden.errors(m));
    if (sum < least) best = {m, std::move(errors)}, least = sum;
  }
  return best;
}

/// Takes the price of hidden parts with which the frames' errors are least. Returns these.
std::vector<FrameErrors> learn_hidden_price(const LeftOutTests& hidden, DepthMetric& costs) {
  std::vector<FrameErrors> least;
  DepthMetric tried = costs;
  for (const float share : {0.25f, 0.3125f, 0.375f, 0.4375f, 0.5f, 0.75f}) {
    tried.hidden = share * costs.one_sided;
    std::vector<FrameErrors> errors = hidden.errors(0, tried);
    if (!least.empty() && total(errors) >= total(least)) continue;
    least = std::move(errors);
    costs.hidden = tried.hidden;
  }
  return least;
}

/// See share_to_hold().
float error_per_spread(std::span<const FrameErrors> errors, const DepthMetric& metric) {
  const double least = 1e-3 * double{metric.mesh_noise};  // of shapes that are all the same
  const std::vector<double> weights = run_weights(errors);
  std::vector<WeightedValue> ratios;
  for (std::size_t i = 0; i < errors.size(); ++i)
    if (errors[i].spread > least) ratios.push_back({errors[i].estimate / errors[i].spread, weights[i]});
  return static_cast<float>(weighted_quantile(std::move(ratios), share_to_hold(errors)));
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
      seen.published_errors(0, learned.metric, regression, regression.blend,
                            predicted.middleRows(predicted.rows() - of_hidden - of_seen, of_seen)),
      hidden.published_errors(0, learned.metric, regression, regression.hidden_blend, predicted.bottomRows(of_hidden))};
  learned.tests = estimated_shapes(frames[0], regression);
  learned.hidden_tests = estimated_shapes(frames[1], regression);
  return frames;
}

/// frames: whole, hidden.
void learn_channels(const SampleSource& source, const FramePair& frames, LearnedFit& learned) {
  const std::array per_spread{double{learned.error_per_spread}, double{learned.hidden_error_per_spread}};
  for (std::size_t first = 0; first < source.channels.size(); first += source.samples.size()) {
    const auto values = std::span(source.channels).subspan(first, source.samples.size());
    auto& bounds = learned.channels.emplace_back();
    for (std::size_t kind = 0; kind < bounds.size(); ++kind)
      bounds[kind] = learn_channel_bound(values, frames[kind], per_spread[kind]);
  }
}

void append(std::vector<FrameErrors>& to, const std::vector<FrameErrors>& more) {
  to.insert(to.end(), more.begin(), more.end());
}

/// Of samples as frames: the residual that the best sample of the other simulations leaves.
std::vector<LeftOut> left_out_residuals(const SampleSource& source, const DepthMetric& metric, unsigned threads) {
  const DepthCamera& camera = source.camera;
  const CellPrices prices = prices_of(metric, camera);
  const LeftOutFrames frames(source, most_compared, 0);
  const auto best = best_of_others(source, frames, std::span(&metric, 1), 1, threads);
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

void learn_limits(const SampleSource& source, unsigned threads, LearnedFit& learned) {
  const std::vector<LeftOut> answers = left_out_residuals(source, learned.metric, threads);
  const ExpectedResiduals expected(answers);
  std::ranges::transform(source.samples, learned.expected.begin(),
                         [&](const Sample& sample) { return expected.at(sample.time_step); });
  learned.limits = misfit_limits(answers, expected, learned.metric.mesh_noise);
}

/// What an ensemble of one simulation has.
LearnedFit not_learned(const SampleSource& source) {
  return {.metric = DepthMetric{}.in(source.length_unit),
          .expected = std::vector<float>(source.samples.size(), 0.0f),
          .bounds = std::vector<SpreadBound>(source.read_field ? 1 + source.fields : 0),
          .shapes = TrainedShapes::untrained(source.camera, source.samples.size())};
}

/// Owns the memory of SensorViews' spans.
struct RenderedImages {
  std::vector<std::uint16_t> depths;
  LearnedFit learned;
};

SampleSource source_of(const Model& model, const DepthCamera& camera) {
  SampleSource source{.camera = camera, .length_unit = std::string(model.length_unit()), .nodes = model.nodes()};
  for (std::uint32_t s = 0; s < model.samples(); ++s) source.samples.push_back(model.sample(s));
  source.read_positions = [&model](std::size_t sample, std::span<float> positions) {
    std::ranges::copy(model.node_positions(static_cast<std::uint32_t>(sample)), positions.begin());
  };
  return source;
}

/// source: without images.
SensorViews rendered_views(const Model& model, SampleSource source, const SampleRenderer& render, unsigned threads,
                           const std::function<void(std::size_t done)>& progress) {
  const std::size_t stride = padded_cells(source.camera);
  auto rendered = std::make_shared<RenderedImages>();
  rendered->depths.assign(model.samples() * stride, empty_cell);
  std::atomic<std::size_t> done{0};
  work_in_parallel(model.samples(), threads, [&](const auto& next) {
    for (std::size_t s = next(); s < model.samples(); s = next()) {
      render(static_cast<std::uint32_t>(s), std::span(rendered->depths).subspan(s * stride, stride));
      const std::size_t now = ++done;
      if (progress) progress(now);
    }
  });
  source.read_images = [&](std::size_t first, std::span<std::uint16_t> images) {
    std::copy_n(rendered->depths.begin() + static_cast<std::ptrdiff_t>(first * stride), images.size(), images.begin());
  };
  rendered->learned = learn_fit(source, threads);
  const LearnedFit& learned = rendered->learned;
  return SensorViews(std::make_shared<const DepthImages>(DepthImages{source.camera,
                                                                     rendered->depths,
                                                                     learned.expected,
                                                                     learned.metric,
                                                                     learned.limits.frame,
                                                                     learned.limits.test,
                                                                     learned.error_per_spread,
                                                                     learned.hidden_error_per_spread,
                                                                     static_cast<float>(learned.pose.variance),
                                                                     learned.pose.by_image,
                                                                     learned.pose.by_points,
                                                                     learned.time_variation,
                                                                     learned.shapes.view(),
                                                                     {},
                                                                     rendered}));
}

}  // namespace

LearnedFit learn_fit(const SampleSource& samples, unsigned threads) {
  const SampleSource source = with_cache(samples);
  LearnedFit learned = not_learned(source);
  if (source.samples.empty() || source.samples.front().simulation == source.samples.back().simulation) {
    learned.channels.resize(source.channels.size() / std::max<std::size_t>(source.samples.size(), 1));
    return learned;
  }
  const std::vector<DepthMetric> metrics = metrics_in(source.length_unit);
  const LeftOutTests whole(source, metrics, most_matched, 0, threads);
  auto [metric, of_whole] = choose_metric(source, whole, metrics, threads);
  learned.metric = metrics[metric];
  const LeftOutTests hidden(source, std::span(&metrics[metric], 1), most_hidden, hidden_by_a_patch, threads);
  std::vector<FrameErrors> of_hidden = learn_hidden_price(hidden, learned.metric);
  const LeftOutTests seen_tests(source, std::span(&metrics[metric], 1), samples_of_tests(source, most_tests), 0,
                                threads);
  const LeftOutTests hidden_tests(source, std::span(&metrics[metric], 1), samples_of_tests(source, most_hidden_tests),
                                  hidden_by_a_patch, threads, HiddenPlace::of_run);
  const Eigen::MatrixXd predicted =
      train_shapes(source, whole, hidden, {seen_tests, hidden_tests, hidden_tests.errors(0, learned.metric)}, of_whole,
                   of_hidden, learned.metric, threads, learned.shapes);
  const ShapeRegression regression = learned.shapes.view();
  of_whole = whole.published_errors(metric, learned.metric, regression, regression.blend,
                                    predicted.topRows(std::ssize(of_whole)));
  of_hidden = hidden.published_errors(0, learned.metric, regression, regression.hidden_blend,
                                      predicted.middleRows(std::ssize(of_whole), std::ssize(of_hidden)));
  FramePair frames =
      regression.blend > 0 ? learn_tests(seen_tests, hidden_tests, regression, predicted, learned) : FramePair{};
  learned.error_per_spread = error_per_spread(of_whole, learned.metric);
  learned.hidden_error_per_spread = error_per_spread(of_hidden, learned.metric);
  if (source.read_field)
    learned.bounds = learn_bounds(source, {of_whole, double{learned.error_per_spread}},
                                  {of_hidden, double{learned.hidden_error_per_spread}}, threads);
  append(frames[0], of_whole);
  append(frames[1], of_hidden);
  learn_channels(source, frames, learned);
  learned.time_variation = time_variation(source, of_whole);
  learned.pose = learn_pose(source, learned.metric, threads);
  learn_limits(source, threads, learned);
  return learned;
}

SensorViews render_depth_images(const Model& model, const DepthRenderer& renderer, unsigned threads,
                                const std::function<void(std::size_t done)>& progress) {
  const auto render = [&](std::uint32_t sample, std::span<std::uint16_t> image) {
    renderer.render(model.node_positions(sample), present_elements(model, sample), image);
  };
  SampleSource source = source_of(model, renderer.camera());
  source.points_of = [&](std::size_t sample) {
    const auto number = static_cast<std::uint32_t>(sample);
    return renderer.points(model.node_positions(number), present_elements(model, number));
  };
  source.most_points = renderer.most_points();
  source.grid = envelope_grid(model.view().envelope);
  const ModelView& view = model.view();
  source.surface = surface_places(view.references.front().vertex_nodes, view.element_nodes, view.info.nodes,
                                  !view.landmark_positions.empty());
  return rendered_views(model, std::move(source), render, threads, progress);
}

SensorViews render_depth_images(const Model& model, const DepthCamera& camera, const SampleRenderer& render,
                                unsigned threads, const std::function<void(std::size_t done)>& progress) {
  return rendered_views(model, source_of(model, camera), render, threads, progress);
}

}  // namespace lbea::bake
