#include "precompute/depth_images/view_learning.hpp"

#include "precompute/parallel.hpp"
#include "runtime/src/kernels/kernels.hpp"

#include <algorithm>
#include <limits>
#include <mutex>

namespace lbea::bake {
namespace {

constexpr std::size_t most_questions = 1024;
constexpr std::size_t block = 64;  // images in memory, per thread

/// The images of some samples, asked which sample of another simulation explains them best.
class Questions {
 public:
  Questions(const DepthCamera& camera, std::span<const Sample> samples, const ImageReader& read)
      : camera_(camera),
        samples_(samples),
        stride_(padded_cells(camera)),
        every_((samples.size() + most_questions - 1) / most_questions),
        count_((samples.size() + every_ - 1) / every_),
        observed_(count_ * stride_) {
    std::vector<std::uint16_t> image(stride_);
    for (std::size_t q = 0; q < count_; ++q) {
      read(q * every_, image);
      for (std::size_t c = 0; c < stride_; ++c)
        observed_[q * stride_ + c] = image[c] == empty_cell ? -1e9f : static_cast<float>(image[c]);
    }
  }

  [[nodiscard]] std::size_t count() const noexcept { return count_; }
  [[nodiscard]] const Sample& sample(std::size_t q) const { return samples_[q * every_]; }

  /// Lowers least[q], in cells squared, to what samples [first, first + images) leave.
  void hold_against(std::size_t first, std::span<const std::uint16_t> images, std::vector<float>& least) const {
    const DepthMetric metric;
    const CellPrices prices{metric.cap / camera_.depth_step, metric.one_sided / camera_.depth_step};
    for (std::size_t q = 0; q < count_; ++q)
      for (std::size_t i = 0; i < images.size() / stride_; ++i) {
        if (samples_[first + i].simulation == sample(q).simulation) continue;
        const CellSums sums = kernels().compare_depths(&observed_[q * stride_], &images[i * stride_], stride_, prices);
        least[q] = std::min(least[q], sums.squares / std::max(sums.filled, 1.0f));
      }
  }

 private:
  const DepthCamera& camera_;
  std::span<const Sample> samples_;
  std::size_t stride_, every_, count_;
  std::vector<float> observed_;  // count x stride
};

std::vector<float> least_squares(const Questions& questions, std::size_t stride, std::size_t samples,
                                 const ImageReader& read, unsigned threads) {
  std::vector<float> least(questions.count(), std::numeric_limits<float>::infinity());
  std::mutex mutex;
  work_in_parallel((samples + block - 1) / block, threads, [&](const auto& next) {
    std::vector<float> mine(questions.count(), std::numeric_limits<float>::infinity());
    std::vector<std::uint16_t> images;
    for (std::size_t b = next(); b * block < samples; b = next()) {
      images.resize(std::min(block, samples - b * block) * stride);
      read(b * block, images);
      questions.hold_against(b * block, images, mine);
    }
    const std::lock_guard lock(mutex);
    for (std::size_t q = 0; q < least.size(); ++q) least[q] = std::min(least[q], mine[q]);
  });
  return least;
}

}  // namespace

LearntViews learn_views(const DepthCamera& camera, std::span<const Sample> samples, const ImageReader& read,
                        unsigned threads) {
  LearntViews learnt{std::vector<float>(samples.size(), 0.0f), {}};
  if (samples.empty() || samples.front().simulation == samples.back().simulation) return learnt;
  const Questions questions(camera, samples, read);
  const std::vector<float> least = least_squares(questions, padded_cells(camera), samples.size(), read, threads);
  std::vector<LeftOut> answers;
  for (std::size_t q = 0; q < questions.count(); ++q)
    answers.push_back({questions.sample(q), least[q] * camera.depth_step * camera.depth_step});
  const ExpectedResiduals expected(answers);
  for (std::size_t s = 0; s < samples.size(); ++s) learnt.expected[s] = expected.at(samples[s].time_step);
  learnt.limits = misfit_limits(answers, expected);
  return learnt;
}

}  // namespace lbea::bake
