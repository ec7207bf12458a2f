#include "precompute/sample_views.hpp"

#include "precompute/parallel.hpp"
#include "runtime/src/kernels.hpp"
#include "runtime/src/model_view.hpp"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#include <memory>

namespace lbea {

namespace {

constexpr std::size_t most_questions = 1024;
constexpr float uncalibrated_limit = 3;  // one simulation alone: nothing to learn from
constexpr float least_limit = 1.2f;
constexpr double false_alarms = 0.01;

/// The best sample of the other simulations.
struct Explanation {
  std::size_t sample = 0;
  float mean_square = std::numeric_limits<float>::infinity();  // length unit squared
};

class Explainer {
 public:
  Explainer(const ViewCamera& camera, std::span<const std::uint16_t> depths, std::span<const std::uint32_t> simulation_of)
      : camera_(camera), depths_(depths), simulation_of_(simulation_of), stride_(padded_cells(camera)), observed_(stride_) {}

  Explanation explain(std::size_t question) {
    for (std::size_t c = 0; c < stride_; ++c) {
      const std::uint16_t depth = depths_[question * stride_ + c];
      observed_[c] = depth == empty_cell ? -1e9f : static_cast<float>(depth);
    }
    const ViewMetric metric;
    const CellPrices prices{metric.cap / camera_.depth_step, metric.one_sided / camera_.depth_step};
    Explanation best;
    for (std::size_t s = 0; s < simulation_of_.size(); ++s) {
      if (simulation_of_[s] == simulation_of_[question]) continue;
      const CellSums sums = kernels().compare_views(observed_.data(), &depths_[s * stride_], stride_, prices);
      const float mean = sums.squares / std::max(sums.filled, 1.0f) * camera_.depth_step * camera_.depth_step;
      if (mean < best.mean_square) best = {s, mean};
    }
    return best;
  }

 private:
  const ViewCamera& camera_;
  std::span<const std::uint16_t> depths_;
  std::span<const std::uint32_t> simulation_of_;
  std::size_t stride_;
  std::vector<float> observed_;
};

// Every sample takes the answer of the nearest question of its own simulation.
std::vector<float> spread(const std::vector<std::size_t>& questions, const std::vector<Explanation>& answers,
                          std::span<const std::uint32_t> simulation_of) {
  std::vector<float> expected(simulation_of.size(), 0.0f);
  std::size_t q = 0;
  for (std::size_t s = 0; s < expected.size(); ++s) {
    const auto closeness = [&](std::size_t i) {
      const auto steps = static_cast<double>(questions[i] > s ? questions[i] - s : s - questions[i]);
      return simulation_of[questions[i]] == simulation_of[s] ? steps : steps + 1e12;
    };
    while (q + 1 < questions.size() && closeness(q + 1) <= closeness(q)) ++q;
    expected[s] = std::sqrt(answers[q].mean_square);
  }
  return expected;
}

}  // namespace

SampleViews::SampleViews(const ViewRenderer& renderer, std::size_t samples)
    : renderer_(renderer), camera_(renderer.camera()), depths_(samples * padded_cells(camera_), empty_cell), expected_(samples, 0.0f),
      misfit_limit_(uncalibrated_limit) {}

void SampleViews::render(std::size_t sample, std::span<const float> positions) {
  const std::size_t stride = padded_cells(camera_);
  renderer_.render(positions, std::span(depths_).subspan(sample * stride, stride));
}

void SampleViews::calibrate(std::span<const std::uint32_t> simulation_of, unsigned threads) {
  if (simulation_of.empty() || simulation_of.front() == simulation_of.back()) return;
  const std::size_t every = (simulation_of.size() + most_questions - 1) / most_questions;
  std::vector<std::size_t> questions;
  for (std::size_t s = 0; s < simulation_of.size(); s += every) questions.push_back(s);
  std::vector<Explanation> answers(questions.size());
  work_in_parallel(questions.size(), threads, [&](const auto& next) {
    Explainer explainer(camera_, depths_, simulation_of);
    for (std::size_t q = next(); q < questions.size(); q = next()) answers[q] = explainer.explain(questions[q]);
  });
  expected_ = spread(questions, answers, simulation_of);

  const float noise = ViewMetric{}.mesh_noise * ViewMetric{}.mesh_noise;
  std::vector<float> misfits;
  for (const Explanation& answer : answers) {
    const float expected = expected_[answer.sample];
    misfits.push_back(std::sqrt((answer.mean_square + noise) / (expected * expected + noise)));
  }
  std::ranges::sort(misfits);
  misfit_limit_ = std::max(misfits[static_cast<std::size_t>(static_cast<double>(misfits.size() - 1) * (1 - false_alarms))], least_limit);
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
  std::vector<std::uint32_t> simulation_of;
  for (std::uint32_t s = 0; s < model.samples(); ++s) simulation_of.push_back(model.sample(s).simulation);
  views->calibrate(simulation_of, threads);
  return SensorViews(std::make_shared<const ViewData>(ViewData{views->camera(), views->depths(), views->expected(), views->misfit_limit(), views}));
}

}  // namespace lbea
