#include "precompute/depth_images/left_out.hpp"

#include "precompute/parallel.hpp"
#include "precompute/rig/counter_random.hpp"

#include <algorithm>
#include <mutex>

namespace lbea::bake {
namespace {

constexpr std::size_t block = 64;  // images in memory, per thread

/// The point that a cell shows, in the sensor's system.
std::array<float, 3> point_of(const DepthCamera& camera, std::size_t cell, float steps) {
  const float depth = camera.depth_origin + camera.depth_step * steps;
  const auto column = static_cast<float>(cell % camera.columns), row = static_cast<float>(cell / camera.columns);
  return {(column + 0.5f - camera.center_column) / camera.focal * depth,
          (row + 0.5f - camera.center_row) / camera.focal * depth, depth};
}

/// Empties the `share` of the filled cells that lies nearest to the point of one of them.
void hide(const DepthCamera& camera, double share, std::uint64_t seed, std::span<float> observed) {
  std::vector<std::pair<float, std::size_t>> filled;  // squared distance from that point; cell
  for (std::size_t c = 0; c < camera.cells(); ++c)
    if (observed[c] >= 0) filled.emplace_back(0.0f, c);
  if (filled.empty()) return;
  const std::size_t middle = filled[splitmix(seed) % filled.size()].second;
  const auto center = point_of(camera, middle, observed[middle]);
  for (auto& [distance, cell] : filled) {
    const auto p = point_of(camera, cell, observed[cell]);
    for (std::size_t axis = 0; axis < 3; ++axis) distance += (p[axis] - center[axis]) * (p[axis] - center[axis]);
  }
  std::ranges::sort(filled);
  filled.resize(static_cast<std::size_t>(share * static_cast<double>(filled.size())));
  for (const auto& [distance, cell] : filled) observed[cell] = nothing_seen;
}

/// Offers the samples from `first` on, whose images these are, to all frames of other simulations.
void offer(const SampleSource& source, const LeftOutFrames& frames, const CellPrices& prices, std::size_t first,
           std::span<const std::uint16_t> images, std::span<BestSamples> best) {
  const std::size_t stride = padded_cells(source.camera);
  for (std::size_t frame = 0; frame < frames.size(); ++frame)
    for (std::size_t i = 0; i < images.size() / stride; ++i)
      if (source.samples[first + i].simulation != source.samples[frames.sample(frame)].simulation)
        best[frame].offer(static_cast<std::uint32_t>(first + i),
                          mean_square(kernels(), frames.observed(frame), &images[i * stride], prices));
}

}  // namespace

LeftOutFrames::LeftOutFrames(const SampleSource& source, std::size_t most, double hidden)
    : stride_(padded_cells(source.camera)) {
  const std::size_t count = std::min(most, source.samples.size());
  for (std::size_t frame = 0; frame < count; ++frame) samples_.push_back(frame * source.samples.size() / count);
  observed_.resize(count * stride_);
  std::vector<std::uint16_t> image(stride_);
  Surroundings surroundings(source.camera);
  for (std::size_t frame = 0; frame < count; ++frame) {
    const auto observed = std::span(observed_).subspan(frame * stride_, stride_);
    source.read_images(samples_[frame], image);
    std::ranges::transform(image, observed.begin(), [](std::uint16_t depth) {
      return depth == empty_cell ? nothing_seen : static_cast<float>(depth);
    });
    if (hidden == 0) continue;
    hide(source.camera, hidden, frame, observed);
    surroundings.limit(observed);
  }
}

std::vector<BestSamples> best_of_others(const SampleSource& source, const LeftOutFrames& frames,
                                        std::span<const DepthMetric> metrics, std::uint32_t most, unsigned threads) {
  const std::size_t stride = padded_cells(source.camera), samples = source.samples.size();
  const std::vector<BestSamples> none(frames.size() * metrics.size(), BestSamples(most));
  std::vector<BestSamples> best = none;
  std::mutex mutex;
  work_in_parallel((samples + block - 1) / block, threads, [&](const auto& next) {
    std::vector<BestSamples> mine = none;
    std::vector<std::uint16_t> images;
    for (std::size_t b = next(); b * block < samples; b = next()) {
      images.resize(std::min(block, samples - b * block) * stride);
      source.read_images(b * block, images);
      for (std::size_t m = 0; m < metrics.size(); ++m)
        offer(source, frames, prices_of(metrics[m], source.camera), b * block, images,
              std::span(mine).subspan(m * frames.size(), frames.size()));
    }
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < best.size(); ++i)
      for (const RankedSample& one : mine[i].ranked()) best[i].offer(one.sample, one.distance);
  });
  return best;
}

}  // namespace lbea::bake
