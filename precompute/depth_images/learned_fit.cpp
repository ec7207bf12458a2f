#include "precompute/depth_images/learned_fit.hpp"

#include "precompute/depth_images/branches.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/depth/surface_fit.hpp"
#include "runtime/src/track/inference.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <deque>
#include <map>

namespace lbea::bake {
namespace {

constexpr std::size_t most_matched = 192, most_compared = 1024;  // frames
constexpr double hidden_by_a_patch = 0.3;                        // share of the cells
constexpr std::size_t most_nodes = 128;                          // at which shapes are compared

/// How far a left-out frame's estimate and match are from its shape: mean distances.
struct FrameErrors {
  std::uint32_t simulation = 0;
  double estimate = 0, match = 0, spread = 0;
};

/// Matches frames by their candidates alone, in a model that has only these.
class LeftOutFitter {
 public:
  LeftOutFitter(const SampleSource& source, const DepthMetric& metric)
      : source_(source),
        stride_(padded_cells(source.camera)),
        row_(3 * source.nodes),
        ids_(FitSettings{}.candidates),
        depths_(ids_.size() * stride_),
        expected_(ids_.size(), 1.0f),
        observed_(stride_),
        truth_(nodes_of(0)),
        positions_(ids_.size() * truth_.size()),
        view_(view_of()),
        fitter_(view_,
                SensorViews(std::make_shared<const DepthImages>(
                    DepthImages{.camera = source.camera, .depths = depths_, .expected = expected_, .metric = metric})),
                1) {}
  LeftOutFitter(const LeftOutFitter&) = delete;
  LeftOutFitter& operator=(const LeftOutFitter&) = delete;

  FrameErrors errors(std::span<const float> observed, std::size_t sample, std::span<const RankedSample> candidates,
                     bool is_hidden) {
    std::vector<RankedSample> proposed;
    for (std::uint32_t k = 0; k < candidates.size(); ++k) {
      source_.read_images(candidates[k].sample, std::span(depths_).subspan(k * stride_, stride_));
      std::ranges::copy(nodes_of(candidates[k].sample), &positions_[k * truth_.size()]);
      proposed.push_back({k, 0});
    }
    truth_ = nodes_of(sample);
    std::ranges::copy(observed, observed_.begin());
    const SurfaceFit fit = fitter_.fit(observed_, proposed, is_hidden);
    std::vector<WeightedRow> rows;
    for (const auto& [candidate, share] : fit.estimate) rows.push_back({shape(candidate.simulation), share});
    std::vector<float> estimate;
    weighted_mean(rows, estimate);
    return {source_.samples[sample].simulation, distance(estimate), distance(shape(fitter_.matches()[0].sample)),
            double{fit.spread}};
  }

 private:
  [[nodiscard]] ModelView view_of() {
    ModelView view;
    for (std::uint32_t k = 0; k < ids_.size(); ++k) ids_[k] = {k, 0};
    view.info.samples = static_cast<std::uint32_t>(ids_.size());
    view.info.nodes = static_cast<std::uint32_t>(truth_.size() / 3);
    view.samples = ids_;
    view.node_positions = positions_;
    return view;
  }
  [[nodiscard]] std::vector<float> nodes_of(std::size_t sample) {
    source_.read_positions(sample, row_);
    return thinned_nodes(row_, most_nodes);
  }
  [[nodiscard]] std::span<const float> shape(std::size_t candidate) const {
    return std::span(positions_).subspan(candidate * truth_.size(), truth_.size());
  }
  [[nodiscard]] double distance(std::span<const float> a) const {
    double sum = 0;
    for (std::size_t i = 0; i < a.size(); i += 3)
      sum += std::hypot(double{a[i]} - double{truth_[i]}, double{a[i + 1]} - double{truth_[i + 1]},
                        double{a[i + 2]} - double{truth_[i + 2]});
    return 3 * sum / static_cast<double>(a.size());
  }

  const SampleSource& source_;
  std::size_t stride_;
  std::vector<float> row_;
  std::vector<std::array<std::uint32_t, 2>> ids_;
  std::vector<std::uint16_t> depths_;
  std::vector<float> expected_, observed_, truth_, positions_;
  ModelView view_;
  SurfaceFitter fitter_;
};

/// The errors of all frames, seen completely and with a part hidden, for each metric.
std::vector<std::vector<FrameErrors>> errors_of(const SampleSource& source, std::span<const DepthMetric> metrics,
                                                unsigned threads) {
  std::vector<std::vector<FrameErrors>> all(metrics.size());
  for (const double hidden : {0.0, hidden_by_a_patch}) {
    const LeftOutFrames frames(source, most_matched, hidden);
    const auto best = best_of_others(source, frames, metrics, FitSettings{}.candidates, threads);
    const std::size_t first = all[0].size();
    for (auto& errors : all) errors.resize(first + frames.size());
    work_in_parallel(frames.size(), threads, [&](const auto& next) {
      std::deque<LeftOutFitter> fitters;
      for (const DepthMetric& metric : metrics) fitters.emplace_back(source, metric);
      for (std::size_t frame = next(); frame < frames.size(); frame = next())
        for (std::size_t m = 0; m < metrics.size(); ++m)
          all[m][first + frame] = fitters[m].errors(frames.observed(frame), frames.sample(frame),
                                                    best[m * frames.size() + frame].ranked(), hidden > 0);
    });
  }
  return all;
}

/// The default first. High costs distinguish large deformations; with low costs a fold that lies a few millimeters
/// elsewhere costs little.
std::vector<DepthMetric> metrics_in(std::string_view length_unit) {
  std::vector<DepthMetric> metrics;
  for (const float scale : {1.0f, 0.25f, 0.5f, 2.0f, 4.0f}) {
    DepthMetric metric = DepthMetric{}.in(length_unit);
    metric.cap *= scale;
    metric.one_sided *= scale;
    metrics.push_back(metric);
  }
  return metrics;
}

double total(std::span<const FrameErrors> errors) {
  double sum = 0;
  for (const FrameErrors& error : errors) sum += error.estimate + error.match;
  return sum;
}

/// The 90 % quantile of error over spread. All runs have the same weight, however many of their states were matched.
float error_per_spread(std::span<const FrameErrors> errors, const DepthMetric& metric) {
  constexpr double coverage = 0.9;
  const double least = 1e-3 * double{metric.mesh_noise};  // of shapes that are all the same
  std::map<std::uint32_t, double> frames;
  for (const FrameErrors& error : errors) ++frames[error.simulation];
  std::vector<std::pair<double, double>> ratios;  // with their weight
  for (const FrameErrors& error : errors)
    if (error.spread > least) ratios.emplace_back(error.estimate / error.spread, 1 / frames[error.simulation]);
  std::ranges::sort(ratios);
  double all = 0, below = 0;
  for (const auto& [ratio, weight] : ratios) all += weight;
  for (const auto& [ratio, weight] : ratios)
    if ((below += weight) >= coverage * all) return static_cast<float>(ratio);
  return 0;
}

/// Owns the memory of SensorViews' spans.
struct RenderedImages {
  std::vector<std::uint16_t> depths;
  LearnedFit learned;
};

}  // namespace

LearnedFit learn_fit(const SampleSource& source, unsigned threads) {
  LearnedFit learned{.metric = DepthMetric{}.in(source.length_unit),
                     .expected = std::vector<float>(source.samples.size(), 0.0f)};
  if (source.samples.empty() || source.samples.front().simulation == source.samples.back().simulation) return learned;

  const std::vector<DepthMetric> metrics = metrics_in(source.length_unit);
  const auto errors = errors_of(source, metrics, threads);
  const auto best = std::ranges::min_element(errors, {}, [](const auto& of_metric) { return total(of_metric); });
  learned.metric = metrics[static_cast<std::size_t>(best - errors.begin())];
  learned.error_per_spread = error_per_spread(*best, learned.metric);

  const LeftOutFrames frames(source, most_compared, 0);
  const auto least = best_of_others(source, frames, std::span(&learned.metric, 1), 1, threads);
  std::vector<LeftOut> answers;
  for (std::size_t frame = 0; frame < frames.size(); ++frame)
    answers.push_back({source.samples[frames.sample(frame)],
                       least[frame].ranked()[0].distance * source.camera.depth_step * source.camera.depth_step});
  const ExpectedResiduals expected(answers);
  std::ranges::transform(source.samples, learned.expected.begin(),
                         [&](const Sample& sample) { return expected.at(sample.time_step); });
  learned.limits = misfit_limits(answers, expected, learned.metric.mesh_noise);
  return learned;
}

SensorViews render_depth_images(const Model& model, const DepthRenderer& renderer, unsigned threads,
                                const std::function<void(std::size_t done)>& progress) {
  const std::size_t stride = padded_cells(renderer.camera());
  auto rendered = std::make_shared<RenderedImages>();
  rendered->depths.assign(model.samples() * stride, empty_cell);
  std::atomic<std::size_t> done{0};
  work_in_parallel(model.samples(), threads, [&](const auto& next) {
    for (std::size_t s = next(); s < model.samples(); s = next()) {
      renderer.render(model.node_positions(static_cast<std::uint32_t>(s)),
                      std::span(rendered->depths).subspan(s * stride, stride));
      const std::size_t now = ++done;
      if (progress) progress(now);
    }
  });
  SampleSource source{
      .camera = renderer.camera(), .length_unit = std::string(model.length_unit()), .nodes = model.nodes()};
  for (std::uint32_t s = 0; s < model.samples(); ++s) source.samples.push_back(model.sample(s));
  source.read_images = [&](std::size_t first, std::span<std::uint16_t> images) {
    std::copy_n(rendered->depths.begin() + static_cast<std::ptrdiff_t>(first * stride), images.size(), images.begin());
  };
  source.read_positions = [&](std::size_t sample, std::span<float> positions) {
    std::ranges::copy(model.node_positions(static_cast<std::uint32_t>(sample)), positions.begin());
  };
  rendered->learned = learn_fit(source, threads);
  const LearnedFit& learned = rendered->learned;
  return SensorViews(std::make_shared<const DepthImages>(
      DepthImages{renderer.camera(), rendered->depths, learned.expected, learned.metric, learned.limits.frame,
                  learned.limits.test, learned.error_per_spread, rendered}));
}

}  // namespace lbea::bake
