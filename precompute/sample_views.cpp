#include "precompute/sample_views.hpp"

#include "precompute/parallel.hpp"
#include "runtime/src/model_view.hpp"
#include "runtime/src/surface_fit.hpp"
#include "runtime/src/view_ranking.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <memory>

namespace lbea {

namespace {

constexpr std::size_t most_questions = 1024;

/// Holds a sample's image against those of the other simulations.
class Explainer {
 public:
  Explainer(const ViewCamera& camera, std::span<const std::uint16_t> depths, std::span<const Sample> samples)
      : camera_(camera), depths_(depths), samples_(samples), stride_(padded_cells(camera)), observed_(stride_),
        ranking_(camera, FitSettings{}.candidates, ViewMetric{}) {}

  /// Mean square, length unit squared.
  float explain(std::size_t question) {
    for (std::size_t c = 0; c < stride_; ++c) {
      const std::uint16_t depth = depths_[question * stride_ + c];
      observed_[c] = depth == empty_cell ? nothing_seen : static_cast<float>(depth);
    }
    others_.clear();
    for (std::uint32_t s = 0; s < samples_.size(); ++s)
      if (samples_[s].simulation != samples_[question].simulation) others_.push_back({s, 0});
    ranking_.rank(observed_, depths_, others_);
    return ranking_.ranked().front().distance * camera_.depth_step * camera_.depth_step;
  }

 private:
  const ViewCamera& camera_;
  std::span<const std::uint16_t> depths_;
  std::span<const Sample> samples_;
  std::size_t stride_;
  std::vector<float> observed_;
  ViewRanking ranking_;
  std::vector<RankedSample> others_;
};

}  // namespace

SampleViews::SampleViews(const ViewRenderer& renderer, std::size_t samples)
    : renderer_(renderer), camera_(renderer.camera()), depths_(samples * padded_cells(camera_), empty_cell), expected_(samples, 0.0f) {}

void SampleViews::render(std::size_t sample, std::span<const float> positions) {
  const std::size_t stride = padded_cells(camera_);
  renderer_.render(positions, std::span(depths_).subspan(sample * stride, stride));
}

void SampleViews::calibrate(std::span<const Sample> samples, unsigned threads) {
  if (samples.empty() || samples.front().simulation == samples.back().simulation) return;
  const std::size_t every = (samples.size() + most_questions - 1) / most_questions;
  std::vector<LeftOut> answers;
  for (std::size_t s = 0; s < samples.size(); s += every) answers.push_back({samples[s], 0});
  work_in_parallel(answers.size(), threads, [&](const auto& next) {
    Explainer explainer(camera_, depths_, samples);
    for (std::size_t q = next(); q < answers.size(); q = next()) answers[q].mean_square = explainer.explain(q * every);
  });
  const ExpectedResiduals expected(answers);
  for (std::size_t s = 0; s < samples.size(); ++s) expected_[s] = expected.at(samples[s].time_step);
  limits_ = misfit_limits(answers, expected);
}

SensorViews render_views(const Model& model, const ViewRenderer& renderer, unsigned threads,
                         const std::function<void(std::size_t done)>& progress) {
  auto views = std::make_shared<SampleViews>(renderer, model.samples());
  std::atomic<std::size_t> done{0};
  work_in_parallel(model.samples(), threads, [&](const auto& next) {
    for (std::size_t s = next(); s < model.samples(); s = next()) {
      views->render(s, model.node_positions(static_cast<std::uint32_t>(s)));
      const std::size_t now = ++done;
      if (progress) progress(now);
    }
  });
  std::vector<Sample> samples;
  for (std::uint32_t s = 0; s < model.samples(); ++s) samples.push_back(model.sample(s));
  views->calibrate(samples, threads);
  return SensorViews(std::make_shared<const ViewData>(ViewData{views->camera(), views->depths(), views->expected(), views->misfit_limit(),
                                                              views->test_misfit_limit(), views}));
}

}  // namespace lbea
