// Samples used as frames of an experiment, and compared with the samples of all other simulations.
#pragma once

#include "precompute/parallel.hpp"
#include "precompute/rig/depth_renderer.hpp"
#include "runtime/src/depth/image_comparison.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/shape_landmarks.hpp"

#include <functional>

namespace lbea::bake {

/// The samples of an ensemble, read a few at a time, from any thread.
struct SampleSource {
  DepthCamera camera;
  std::string length_unit;
  std::vector<Sample> samples{};  // ascending
  std::vector<double> times{};    // of the samples, s; empty: no forecast is learned
  std::size_t nodes = 0;
  /// Fills `images` with those of the samples from `first` on, padded_cells() each.
  std::function<void(std::size_t first, std::span<std::uint16_t> images)> read_images{};
  /// Fills `positions`: nodes x 3.
  std::function<void(std::size_t sample, std::span<float> positions)> read_positions{};
  /// Positions of at most 128 nodes spread over the mesh: enough to compare shapes. Set by with_cache().
  std::function<std::vector<float>(std::size_t sample)> nodes_of{};
  /// What the rig measures of a sample: at most most_points, in its coordinates. Not set: no poses are measured by
  /// points.
  std::function<std::vector<Point>(std::size_t sample)> points_of{};
  std::size_t most_points = 0;
  CellGrid grid{};          // of the envelope
  SurfacePlaces surface{};  // at which points are compared
  /// Positions of these places. Set by with_cache().
  std::function<std::vector<float>(std::size_t sample)> surface_of{};
  std::vector<float> channels{};           // channels x samples
  std::optional<EstimatePrices> prices{};  // of estimates, learned before
  std::size_t fields = 0, elements = 0;
  /// Fills `values`: one per element.
  std::function<void(std::size_t field, std::size_t sample, std::span<float> values)> read_field{};
};

/// `count` of `all` samples, ascending: one of each of as many equal parts, chosen at random, because equal distances
/// choose the same few states of every run if the numbers of runs and of chosen samples have a large common divisor.
/// Some twice if count > all.
[[nodiscard]] std::vector<std::size_t> spread_samples(std::size_t count, std::size_t all);

/// The depth image of a sample as a frame's: padded_cells() values.
[[nodiscard]] std::vector<float> observed_image(const SampleSource& source, std::size_t sample);

/// Changes an image as sensors do: depths are blurred or not; half of the cells at edges are lost, or single cells, or
/// none; all depths are offset, with the standard deviation `noise`, in depth steps. seed: determines which.
void disturb(const DepthCamera& camera, float noise, std::uint64_t seed, std::span<float> observed);

/// Where a part of frames is hidden: elsewhere in each, or at one place in consecutive ones of a run.
enum class HiddenPlace : std::uint8_t { of_frame, of_run };

/// Depth images of some samples as frames.
class LeftOutFrames {
 public:
  /// At most `most` samples, spread over all. hidden: the share of each image's filled cells that is taken away: those
  /// nearest to one of them, chosen at random, as something in front of the component would hide them. noise: every
  /// second image is disturbed with this one (see disturb()); 0: none is.
  LeftOutFrames(const SampleSource& source, std::size_t most, double hidden, float noise = 0);
  /// The same for these samples.
  LeftOutFrames(const SampleSource& source, std::vector<std::size_t> samples, double hidden, float noise = 0,
                HiddenPlace place = HiddenPlace::of_frame);

  [[nodiscard]] std::size_t size() const noexcept { return samples_.size(); }
  [[nodiscard]] std::size_t sample(std::size_t frame) const noexcept { return samples_[frame]; }
  /// padded_cells() depths in steps.
  [[nodiscard]] std::span<const float> observed(std::size_t frame) const noexcept {
    return std::span(observed_).subspan(frame * stride_, stride_);
  }

 private:
  std::size_t stride_;
  std::vector<std::size_t> samples_;
  std::vector<float> observed_;
};

/// The `most` samples of other simulations with the least mean square, in squared depth steps, for each frame and each
/// metric: all frames of the first metric, then those of the second. The images are read once, a few at a time; memory
/// does not grow with their number.
[[nodiscard]] std::vector<BestSamples> best_of_others(const SampleSource& source, const LeftOutFrames& frames,
                                                      std::span<const DepthMetric> metrics, std::uint32_t most,
                                                      const Workers& workers);

}  // namespace lbea::bake
