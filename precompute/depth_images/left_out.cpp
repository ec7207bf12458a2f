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

/// Calls visit(cell, filled cells among the 3 x 3 around it, sum of their depths) for all filled cells.
template <class Visit>
void visit_filled(const DepthCamera& camera, std::span<const float> observed, const Visit& visit) {
  const auto low = [](std::uint32_t i) { return i - std::min(i, 1u); };
  for (std::uint32_t row = 0; row < camera.rows; ++row)
    for (std::uint32_t column = 0; column < camera.columns; ++column) {
      const std::size_t cell = std::size_t{row} * camera.columns + column;
      if (observed[cell] < 0) continue;
      std::size_t filled = 0;
      float sum = 0;
      for (std::uint32_t r = low(row); r < std::min(row + 2, camera.rows); ++r)
        for (std::uint32_t c = low(column); c < std::min(column + 2, camera.columns); ++c)
          if (const float depth = observed[std::size_t{r} * camera.columns + c]; depth >= 0) ++filled, sum += depth;
      visit(cell, filled, sum);
    }
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

std::vector<std::size_t> spread_samples(std::size_t count, std::size_t all) {
  std::vector<std::size_t> chosen(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t begin = i * all / count, end = (i + 1) * all / count;
    chosen[i] = begin + splitmix(count + i) % std::max<std::size_t>(end - begin, 1);
  }
  return chosen;
}

std::vector<float> observed_image(const SampleSource& source, std::size_t sample) {
  std::vector<std::uint16_t> image(padded_cells(source.camera));
  source.read_images(sample, image);
  std::vector<float> observed(image.size());
  std::ranges::transform(image, observed.begin(), [](std::uint16_t depth) {
    return depth == empty_cell ? nothing_seen : static_cast<float>(depth);
  });
  return observed;
}

void disturb(const DepthCamera& camera, float noise, std::uint64_t seed, std::span<float> observed) {
  constexpr std::size_t whole = 9;                 // cells around one that is not at an edge
  constexpr double at_edges = 0.5, single = 0.05;  // shares that are lost
  const std::uint64_t kind = splitmix(seed);
  const std::vector<float> before(observed.begin(), observed.end());
  const auto offset = static_cast<float>(CounterRandom(seed, camera.cells()).normal()) * noise;
  visit_filled(camera, before, [&](std::size_t cell, std::size_t filled, float sum) {
    const double drawn = CounterRandom(seed, cell).uniform(Draw::dropout);
    const bool is_lost = kind / 2 % 3 == 0 ? filled < whole && drawn < at_edges : kind / 2 % 3 == 1 && drawn < single;
    const float depth = kind % 2 == 0 ? sum / static_cast<float>(filled) : before[cell];
    observed[cell] = is_lost ? nothing_seen : std::max(depth + offset, 0.0f);
  });
}

LeftOutFrames::LeftOutFrames(const SampleSource& source, std::size_t most, double hidden, float noise)
    : LeftOutFrames(source, spread_samples(std::min(most, source.samples.size()), source.samples.size()), hidden,
                    noise) {}

LeftOutFrames::LeftOutFrames(const SampleSource& source, std::vector<std::size_t> samples, double hidden, float noise)
    : stride_(padded_cells(source.camera)), samples_(std::move(samples)) {
  const std::size_t count = samples_.size();
  observed_.resize(count * stride_);
  Surroundings surroundings(source.camera);
  for (std::size_t frame = 0; frame < count; ++frame) {
    const auto observed = std::span(observed_).subspan(frame * stride_, stride_);
    std::ranges::copy(observed_image(source, samples_[frame]), observed.begin());
    if (noise > 0 && frame % 2 == 1) disturb(source.camera, noise, frame, observed);
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
