#include "precompute/left_out/left_out_frames.hpp"

#include "precompute/rig/counter_random.hpp"
#include "runtime/src/match/shape_landmarks.hpp"

#include <algorithm>
#include <bit>
#include <mutex>
#include <optional>

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

/// The point of one of the filled cells; nothing when there is none.
std::optional<std::array<float, 3>> point_in(const DepthCamera& camera, std::uint64_t seed,
                                             std::span<const float> observed) {
  std::vector<std::size_t> filled;
  for (std::size_t c = 0; c < camera.cells(); ++c)
    if (observed[c] >= 0) filled.push_back(c);
  if (filled.empty()) return {};
  const std::size_t cell = filled[splitmix(seed) % filled.size()];
  return point_of(camera, cell, observed[cell]);
}

/// Empties the `share` of the filled cells that lies nearest to a point.
void hide(const DepthCamera& camera, double share, const std::array<float, 3>& center, std::span<float> observed) {
  std::vector<std::pair<float, std::size_t>> filled;  // squared distance; cell
  for (std::size_t cell = 0; cell < camera.cells(); ++cell) {
    if (observed[cell] < 0) continue;
    float distance = 0;
    const auto p = point_of(camera, cell, observed[cell]);
    for (std::size_t axis = 0; axis < 3; ++axis) distance += (p[axis] - center[axis]) * (p[axis] - center[axis]);
    filled.emplace_back(distance, cell);
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

/// A bit per cell.
using Cells = std::vector<std::uint64_t>;

template <class IsSet>
Cells cells_where(std::size_t count, const IsSet& is_set) {
  Cells cells((count + 63) / 64);
  for (std::size_t c = 0; c < count; ++c) cells[c / 64] |= std::uint64_t{is_set(c)} << c % 64;
  return cells;
}

std::size_t number_of(const Cells& cells) {
  std::size_t sum = 0;
  for (const std::uint64_t bits : cells) sum += static_cast<std::size_t>(std::popcount(bits));
  return sum;
}

/// What cells a sample's image fills.
struct FilledCells {
  Cells cells;
  std::size_t number;

  explicit FilledCells(std::span<const std::uint16_t> image)
      : cells(cells_where(image.size(), [&](std::size_t c) { return image[c] != empty_cell; })),
        number(number_of(cells)) {}
};

/// What cells a frame fills, and which ones nothing hides.
struct FrameCells {
  Cells filled, observed;
  std::size_t number_filled, number_observed;

  explicit FrameCells(std::span<const float> image)
      : filled(cells_where(image.size(), [&](std::size_t c) { return image[c] >= 0; })),
        observed(cells_where(image.size(), [&](std::size_t c) { return image[c] > not_observed; })),
        number_filled(number_of(filled)),
        number_observed(number_of(observed)) {}

  /// The share of the cells filled by either that only one of them fills, at least.
  [[nodiscard]] double least_one_sided(const FilledCells& sample) const {
    std::size_t one_sided = 0;
    for (std::size_t i = 0; i < filled.size(); ++i)
      one_sided += static_cast<std::size_t>(std::popcount((filled[i] ^ sample.cells[i]) & observed[i]));
    const std::size_t most_filled = (number_filled + std::min(sample.number, number_observed) + one_sided) / 2;
    return static_cast<double>(one_sided) / static_cast<double>(std::max<std::size_t>(most_filled, 1));
  }
};

/// Compares the images of a few samples with all frames, by each metric.
class BlockComparison {
 public:
  BlockComparison(const SampleSource& source, const LeftOutFrames& frames, std::span<const DepthMetric> metrics)
      : source_(source), frames_(frames), stride_(padded_cells(source.camera)) {
    for (const DepthMetric& metric : metrics) prices_.push_back(prices_of(metric, source.camera));
    for (std::size_t frame = 0; frame < frames.size(); ++frame) cells_.emplace_back(frames.observed(frame));
  }

  /// Offers the samples from `first` on, whose images these are, to all frames of other simulations.
  void offer(std::size_t first, std::span<const std::uint16_t> images, std::span<BestSamples> best) const {
    std::vector<FilledCells> filled;
    for (std::size_t i = 0; i < images.size(); i += stride_) filled.emplace_back(images.subspan(i, stride_));
    for (std::size_t frame = 0; frame < frames_.size(); ++frame)
      for (std::size_t i = 0; i < filled.size(); ++i)
        if (source_.samples[first + i].simulation != source_.samples[frames_.sample(frame)].simulation)
          offer(first + i, &images[i * stride_], cells_[frame].least_one_sided(filled[i]), frame, best);
  }

 private:
  /// Does not compare images whose outlines alone differ too much.
  void offer(std::size_t sample, const std::uint16_t* image, double one_sided, std::size_t frame,
             std::span<BestSamples> best) const {
    constexpr double rounding = 1e-3;  // of a sum of squares
    for (std::size_t m = 0; m < prices_.size(); ++m) {
      BestSamples& of_frame = best[m * frames_.size() + frame];
      const double least = (1 - rounding) * one_sided * double{prices_[m].one_sided} * double{prices_[m].one_sided};
      if (least <= double{of_frame.bound()})
        of_frame.offer(static_cast<std::uint32_t>(sample),
                       mean_square(kernels(), frames_.observed(frame), image, prices_[m]));
    }
  }

  const SampleSource& source_;
  const LeftOutFrames& frames_;
  std::size_t stride_;
  std::vector<CellPrices> prices_;  // per metric
  std::vector<FrameCells> cells_;   // per frame
};

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

LeftOutFrames::LeftOutFrames(const SampleSource& source, std::vector<std::size_t> samples, double hidden, float noise,
                             HiddenPlace place)
    : stride_(padded_cells(source.camera)), samples_(std::move(samples)) {
  const std::size_t count = samples_.size();
  observed_.resize(count * stride_);
  Surroundings surroundings(source.camera);
  std::optional<std::array<float, 3>> center;
  for (std::size_t frame = 0; frame < count; ++frame) {
    const auto observed = std::span(observed_).subspan(frame * stride_, stride_);
    std::ranges::copy(observed_image(source, samples_[frame]), observed.begin());
    if (noise > 0 && frame % 2 == 1) disturb(source.camera, noise, frame, observed);
    if (hidden == 0) continue;
    const bool continues = place == HiddenPlace::of_run && frame > 0 &&
                           source.samples[samples_[frame - 1]].simulation == source.samples[samples_[frame]].simulation;
    if (!continues) center = point_in(source.camera, frame, observed);
    if (center) hide(source.camera, hidden, *center, observed);
    surroundings.limit(observed);
  }
}

std::vector<BestSamples> best_of_others(const SampleSource& source, const LeftOutFrames& frames,
                                        std::span<const DepthMetric> metrics, std::uint32_t most,
                                        const Workers& workers) {
  const std::size_t stride = padded_cells(source.camera), samples = source.samples.size();
  const BlockComparison comparison(source, frames, metrics);
  const std::vector<BestSamples> none(frames.size() * metrics.size(), BestSamples(most));
  std::vector<BestSamples> best = none;
  std::mutex mutex;
  work_in_parallel((samples + block - 1) / block, workers, [&](const auto& next) {
    std::vector<BestSamples> mine = none;
    std::vector<std::uint16_t> images;
    for (std::size_t b = next(); b * block < samples; b = next()) {
      images.resize(std::min(block, samples - b * block) * stride);
      source.read_images(b * block, images);
      comparison.offer(b * block, images, mine);
    }
    const std::lock_guard lock(mutex);
    for (std::size_t i = 0; i < best.size(); ++i)
      for (const RankedSample& one : mine[i].ranked()) best[i].offer(one.sample, one.distance);
  });
  return best;
}

}  // namespace lbea::bake
