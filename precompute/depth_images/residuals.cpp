#include "precompute/depth_images/residuals.hpp"

#include "precompute/parallel.hpp"
#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/model/model_view.hpp"

#include <atomic>
#include <mutex>

namespace lbea::bake {
namespace {

double median(std::vector<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  return *middle;
}

// Beyond this many standard deviations, estimated by the median absolute deviation.
double robust_limit(const std::vector<double>& values, double deviations) {
  constexpr double normal = 1.4826;  // standard deviations of a normal distribution per median absolute deviation
  const double center = median(values);
  std::vector<double> apart;
  for (const double value : values) apart.push_back(std::abs(value - center));
  return center + deviations * normal * median(apart);
}

constexpr std::size_t most_left_out = 1024;
constexpr std::size_t block = 64;  // images in memory, per thread

/// Images of some samples, each to be compared with the samples of the other simulations.
class LeftOutImages {
 public:
  LeftOutImages(const DepthCamera& camera, std::span<const Sample> samples, const ImageReader& read,
                const DepthMetric& metric)
      : prices_{metric.cap / camera.depth_step, metric.one_sided / camera.depth_step},
        samples_(samples),
        stride_(padded_cells(camera)),
        every_((samples.size() + most_left_out - 1) / most_left_out),
        count_((samples.size() + every_ - 1) / every_),
        observed_(count_ * stride_) {
    std::vector<std::uint16_t> image(stride_);
    Surroundings surroundings(camera);
    for (std::size_t q = 0; q < count_; ++q) {
      read(q * every_, image);
      for (std::size_t c = 0; c < stride_; ++c)
        observed_[q * stride_ + c] = image[c] == empty_cell ? nothing_seen : static_cast<float>(image[c]);
      surroundings.limit(std::span(observed_).subspan(q * stride_, stride_));
    }
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] const Sample& sample(std::size_t q) const { return samples_[q * every_]; }

  /// Lowers least[q], the mean squared residual in depth steps, by the samples from `first` on.
  void compare_with(std::size_t first, std::span<const std::uint16_t> images, std::vector<float>& least) const {
    for (std::size_t q = 0; q < count_; ++q)
      for (std::size_t i = 0; i < images.size() / stride_; ++i) {
        if (samples_[first + i].simulation == sample(q).simulation) continue;
        const CellSums sums = kernels().compare_depths(&observed_[q * stride_], &images[i * stride_], stride_, prices_);
        least[q] = std::min(least[q], sums.squares / std::max(sums.filled, 1.0f));
      }
  }

 private:
  CellPrices prices_;
  std::span<const Sample> samples_;
  std::size_t stride_, every_, count_;
  std::vector<float> observed_;  // count x stride
};

std::vector<float> least_squares(const LeftOutImages& left_out, std::size_t stride, std::size_t samples,
                                 const ImageReader& read, unsigned threads) {
  std::vector<float> least(left_out.count(), std::numeric_limits<float>::infinity());
  std::mutex mutex;
  work_in_parallel((samples + block - 1) / block, threads, [&](const auto& next) {
    std::vector<float> mine(left_out.count(), std::numeric_limits<float>::infinity());
    std::vector<std::uint16_t> images;
    for (std::size_t b = next(); b * block < samples; b = next()) {
      images.resize(std::min(block, samples - b * block) * stride);
      read(b * block, images);
      left_out.compare_with(b * block, images, mine);
    }
    const std::lock_guard lock(mutex);
    for (std::size_t q = 0; q < least.size(); ++q) least[q] = std::min(least[q], mine[q]);
  });
  return least;
}

/// Owns the memory of SensorViews' spans.
struct RenderedImages {
  std::vector<std::uint16_t> depths;
  LearnedResiduals learned;
};

}  // namespace

ExpectedResiduals::ExpectedResiduals(std::span<const LeftOut> answers) {
  std::uint32_t last = 0;
  for (const LeftOut& answer : answers) last = std::max(last, answer.sample.time_step);
  const std::size_t fewest = std::min<std::size_t>(5, answers.size());
  for (std::uint32_t step = 0; step <= last; ++step) {
    std::vector<double> near;
    for (std::uint32_t reach = 0; near.size() < fewest && reach <= last; ++reach) {
      near.clear();
      for (const LeftOut& answer : answers) {
        const std::uint32_t other = answer.sample.time_step;
        if (std::max(other, step) - std::min(other, step) <= reach) near.push_back(double{answer.mean_square});
      }
    }
    by_step_.push_back(near.empty() ? 0.0f : static_cast<float>(std::sqrt(median(near))));
  }
}

float ExpectedResiduals::at(std::uint32_t time_step) const {
  return by_step_.empty() ? 0.0f : by_step_[std::min<std::size_t>(time_step, by_step_.size() - 1)];
}

MisfitLimits misfit_limits(std::span<const LeftOut> answers, const ExpectedResiduals& expected, float mesh_noise) {
  constexpr double frame_deviations = 3, test_deviations = 3.5;
  constexpr double least = 1.2;
  constexpr std::size_t first_frames = 3;  // a mean over fewer is not reliable
  const double noise = double{mesh_noise} * double{mesh_noise};
  std::vector<double> misfits, means;
  double sum = 0, weights = 0;
  std::size_t count = 0;
  for (std::size_t i = 0; i < answers.size(); ++i) {
    if (i == 0 || answers[i].sample.simulation != answers[i - 1].sample.simulation) sum = weights = 0, count = 0;
    const double usual = double{expected.at(answers[i].sample.time_step)};
    misfits.push_back(0.5 * std::log((double{answers[i].mean_square} + noise) / (usual * usual + noise)));
    const double weight = 1 / (usual * usual + noise);  // as Tracker weighs its frames
    sum += weight * misfits.back();
    weights += weight;
    if (++count > first_frames) means.push_back(sum / weights);
  }
  MisfitLimits limits;
  if (misfits.size() < 8) return limits;
  limits.frame = static_cast<float>(std::max(std::exp(robust_limit(misfits, frame_deviations)), least));
  limits.test = means.size() < 8 ? limits.frame
                                 : static_cast<float>(std::max(std::exp(robust_limit(means, test_deviations)), least));
  return limits;
}

LearnedResiduals learn_residuals(const DepthCamera& camera, std::span<const Sample> samples, const ImageReader& read,
                                 const DepthMetric& metric, unsigned threads) {
  LearnedResiduals learned{std::vector<float>(samples.size(), 0.0f), {}};
  if (samples.empty() || samples.front().simulation == samples.back().simulation) return learned;
  const LeftOutImages left_out(camera, samples, read, metric);
  const std::vector<float> least = least_squares(left_out, padded_cells(camera), samples.size(), read, threads);
  std::vector<LeftOut> answers;
  for (std::size_t q = 0; q < left_out.count(); ++q)
    answers.push_back({left_out.sample(q), least[q] * camera.depth_step * camera.depth_step});
  const ExpectedResiduals expected(answers);
  for (std::size_t s = 0; s < samples.size(); ++s) learned.expected[s] = expected.at(samples[s].time_step);
  learned.limits = misfit_limits(answers, expected, metric.mesh_noise);
  return learned;
}

SensorViews render_depth_images(const Model& model, const DepthRenderer& renderer, unsigned threads,
                                const std::function<void(std::size_t done)>& progress) {
  const DepthCamera& camera = renderer.camera();
  const std::size_t stride = padded_cells(camera);
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
  std::vector<Sample> samples;
  for (std::uint32_t s = 0; s < model.samples(); ++s) samples.push_back(model.sample(s));
  const auto read = [&](std::size_t first, std::span<std::uint16_t> images) {
    std::copy_n(rendered->depths.begin() + static_cast<std::ptrdiff_t>(first * stride), images.size(), images.begin());
  };
  rendered->learned = learn_residuals(camera, samples, read, DepthMetric{}.in(model.length_unit()), threads);
  return SensorViews(std::make_shared<const DepthImages>(
      DepthImages{camera, rendered->depths, rendered->learned.expected, rendered->learned.limits.frame,
                  rendered->learned.limits.test, rendered}));
}

}  // namespace lbea::bake
