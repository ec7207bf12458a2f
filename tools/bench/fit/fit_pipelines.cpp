// Method fit: the product, and the same written plainly with libraries.
#include "runtime/src/depth/thinned_images.hpp"
#include "runtime/src/fit/surface_fit.hpp"
#include "tools/bench/nanoflann_pipeline.hpp"

#include <lbea/inference.hpp>
#include <lbea/test_history.hpp>
#include <lbea/tracker.hpp>

#include <algorithm>

namespace lbea::tool::bench {
namespace {

/// The product. With the history of the test its frames depend on each other; the check is of single frames.
class FitPipeline : public Pipeline {
 public:
  FitPipeline(const Model& model, const MatcherConfig& config, const FitExtras& extras)
      : config_(config), extras_(extras), matcher_(model, config) {
    if (!extras.tracks) return;
    history_.emplace(model);
    tracker_.emplace(model);
  }

  [[nodiscard]] std::string name() const override { return "fit"; }

  PipelineTimes match(const Frame& frame) override {
    const MatchResult result = history_ ? matcher_.match(frame, *history_) : matcher_.match(frame);
    PipelineTimes times{result.elapsed_ns};
    Stopwatch watch;
    if (tracker_) tracker_->update(result);
    if (tracker_) times.track = watch.lap_ns();
    if (!extras_.inferred) return times;
    if (!result.fit.candidates.empty()) infer_field(matcher_.model(), *extras_.inferred, result.fit, field_);
    times.infer = watch.lap_ns();
    return times;
  }

  // Nearest points, proposed samples and depth image are not in the result: they are computed by the same stages.
  [[nodiscard]] Answer answer(const Frame& frame) override {
    if (!stages_) stages_.emplace(matcher_.model(), config_);
    return stages_->answer(frame);
  }

 private:
  struct Stages {
    Stages(const Model& model, const MatcherConfig& config)
        : T_reference_sensor(config.T_reference_sensor),
          views(SensorViews::baked_into(model)),
          proposer(kernels_pipeline(model, proposing(config), kernels(), "fit")),
          index(envelope_grid(model.view().envelope), config.max_points),
          image(views.data()->camera),
          fitter(model.view(), views, config.max_matches),
          matcher(model, config) {}

    Answer answer(const Frame& frame) {
      const bool proposes = fitter.search().proposes();
      Answer answer = proposes ? Answer{} : proposer->answer(frame);
      index.build(frame.points, T_reference_sensor);
      image.build(index);
      SurfaceFit fit = fitter.fit(index, answer.ranked);
      fitter.correct(index, fit);
      const MatchResult result = matcher.match(frame);
      if (!std::ranges::equal(result.fit.candidates, fit.candidates, {}, &Match::distance, &Match::distance) ||
          !std::ranges::equal(result.fit.estimate, fit.estimate, {}, &WeightedSample::weight, &WeightedSample::weight))
        throw Error(Status::bad_input, "frame " + std::to_string(frame.id) +
                                           ": the candidates or the estimate of the matcher differ from those of its "
                                           "stages run one by one");
      const std::size_t cells = views.data()->camera.cells();
      answer.fit.emplace();
      if (proposes) answer.fit->proposed.assign(fitter.search().proposed().begin(), fitter.search().proposed().end());
      answer.fit->depth_image.assign(image.cells().begin(), image.cells().begin() + static_cast<std::ptrdiff_t>(cells));
      for (const Match& match : fit.candidates)
        answer.fit->candidates.push_back({matcher.model().sample_index(match.sample), match.distance});
      answer.fit->is_hidden = fitter.is_hidden();
      return answer;
    }

    RigidTransform T_reference_sensor;
    SensorViews views;
    std::unique_ptr<Pipeline> proposer;
    CloudIndex index;
    FrameDepthImage image;
    SurfaceFitter fitter;
    Matcher matcher;
  };

  MatcherConfig config_;
  FitExtras extras_;
  Matcher matcher_;
  std::optional<TestHistory> history_;
  std::optional<Tracker> tracker_;
  Inferred field_;
  std::optional<Stages> stages_;  // made on first use, for the check
};

class PlainFitPipeline : public Pipeline {
 public:
  PlainFitPipeline(const Model& model, const MatcherConfig& config)
      : views_(SensorViews::baked_into(model)), images_(*views_.data()), proposer_(model, proposing(config)) {}

  [[nodiscard]] std::string name() const override { return proposer_.name(); }

  PipelineTimes match(const Frame& frame) override {
    PipelineTimes times = proposer_.match(frame);
    Stopwatch watch;
    draw_depth_image();
    times.stages.depth_image = watch.lap_ns();
    rank();
    times.stages.ranking = watch.lap_ns();
    return times;
  }

  [[nodiscard]] Answer answer(const Frame& frame) override {
    Answer answer = proposer_.answer(frame);
    draw_depth_image();
    answer.fit.emplace().depth_image = observed_;
    rank();
    answer.fit->candidates = candidates_;
    return answer;
  }

 private:
  /// Mean depth per cell; cells with few points are empty.
  void draw_depth_image() {
    const DepthCamera& camera = images_.camera;
    const RigidTransform& T = camera.T_reference_sensor;
    observed_.assign(camera.cells(), 0);
    points_.assign(camera.cells(), 0);
    for (const auto& p : proposer_.points().positions) {
      const float x = p[0] - T[3], y = p[1] - T[7], z = p[2] - T[11];
      const float depth = T[2] * x + T[6] * y + T[10] * z;
      if (!(depth > 0)) continue;
      const float column = camera.focal * (T[0] * x + T[4] * y + T[8] * z) / depth + camera.center_column,
                  row = camera.focal * (T[1] * x + T[5] * y + T[9] * z) / depth + camera.center_row;
      if (!(column >= 0 && row >= 0 && column < static_cast<float>(camera.columns) &&
            row < static_cast<float>(camera.rows)))
        continue;
      const std::size_t cell = static_cast<std::size_t>(row) * camera.columns + static_cast<std::size_t>(column);
      observed_[cell] += (depth - camera.depth_origin) / camera.depth_step;
      points_[cell] += 1;
    }
    float points = 0, filled = 0;
    for (const float count : points_) points += count, filled += count > 0 ? 1.0f : 0.0f;
    const float fewest = 0.25f * points / std::max(filled, 1.0f);
    for (std::size_t c = 0; c < points_.size(); ++c)
      observed_[c] = points_[c] > 0 && points_[c] >= fewest ? observed_[c] / points_[c] : nothing_seen;
  }

  [[nodiscard]] float mean_square(std::span<const float> observed, std::uint32_t sample) const {
    const CellPrices prices = prices_of(images_.metric, images_.camera);
    const auto image = images_.of_sample(sample);
    float squares = 0, filled = 0;
    for (std::size_t c = 0; c < observed.size(); ++c) {
      const bool in_frame = observed[c] >= 0, in_sample = image[c] != empty_cell;
      if (observed[c] == not_observed || !(in_frame || in_sample)) continue;
      const float difference = std::min(std::abs(observed[c] - static_cast<float>(image[c])), prices.cap);
      squares += square(in_frame && in_sample ? difference : prices.one_sided);
      filled += 1;
    }
    return squares / std::max(filled, 1.0f);
  }

  void rank() {
    const std::size_t count = FitSettings{}.candidates;
    std::vector<float> observed = observed_;
    std::vector<RankedSample> compared;
    for (const RankedSample& one : proposer_.ranked())
      compared.push_back({one.sample, mean_square(observed, one.sample)});
    candidates_ = least(std::move(compared), count);
    for (std::size_t c = 0; c < observed.size(); ++c)
      if (observed[c] == nothing_seen &&
          std::ranges::all_of(candidates_, [&](auto& one) { return images_.of_sample(one.sample)[c] != empty_cell; }))
        observed[c] = not_observed;
    for (RankedSample& one : candidates_)
      one.distance = images_.camera.depth_step * std::sqrt(mean_square(observed, one.sample));
    candidates_ = least(std::move(candidates_), count);
  }

  SensorViews views_;
  const DepthImages& images_;
  NanoflannPipeline proposer_;
  std::vector<float> observed_, points_;
  std::vector<RankedSample> candidates_;
};

}  // namespace

MatcherConfig proposing(MatcherConfig config) {
  config.method = Method::lbea;
  config.max_matches = std::max(config.max_matches, FitSettings{}.proposals);
  return config;
}

std::unique_ptr<Pipeline> fit_pipeline(const Model& model, const MatcherConfig& config, const FitExtras& extras) {
  return std::make_unique<FitPipeline>(model, config, extras);
}

std::unique_ptr<Pipeline> plain_fit_pipeline(const Model& model, const MatcherConfig& config) {
  return std::make_unique<PlainFitPipeline>(model, config);
}

}  // namespace lbea::tool::bench
