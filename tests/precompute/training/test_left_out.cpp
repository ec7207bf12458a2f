// The comparison of left-out frames with all samples, and the memory of samples read before.
#include "precompute/left_out/left_out_frames.hpp"
#include "precompute/left_out/sample_cache.hpp"
#include "precompute/rig/counter_random.hpp"
#include "tests/precompute/training/depth_samples.hpp"

#include <doctest/doctest.h>

#include <atomic>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr ImageSize disc_image{20, 11};

/// Images with discs of many sizes and depths; a node's position tells its sample.
SampleSource discs() {
  SampleSource source = depth_samples(disc_image, 5, 40);
  source.nodes = 500;
  source.read_images = [](std::size_t first, std::span<std::uint16_t> images) {
    constexpr std::size_t stride = padded_cells(disc_image.columns * disc_image.rows);
    std::ranges::fill(images, empty_cell);
    for (std::size_t i = 0; i < images.size() / stride; ++i) {
      const std::uint64_t drawn = splitmix(first + i);
      const auto number = [&](unsigned shift, std::uint64_t most) {
        return static_cast<double>((drawn >> shift) % most);
      };
      const double x = 6 + number(0, 8), y = 3 + number(8, 5), radius = 2 + number(16, 6);
      for (std::size_t cell = 0; cell < disc_image.columns * disc_image.rows; ++cell) {
        const double dx = static_cast<double>(cell % disc_image.columns) - x,
                     dy = static_cast<double>(cell / disc_image.columns) - y;
        if (dx * dx + dy * dy < radius * radius)
          images[i * stride + cell] =
              static_cast<std::uint16_t>(500 + 40 * static_cast<int>(number(24, 16)) + 5 * static_cast<int>(dx));
      }
    }
  };
  source.read_positions = [](std::size_t sample, std::span<float> positions) {
    for (std::size_t i = 0; i < positions.size(); ++i) positions[i] = static_cast<float>(1000 * sample + i);
  };
  return source;
}

}  // namespace

TEST_CASE("the best samples are those of an exhaustive comparison, for whole and for hidden frames") {
  const SampleSource source = discs();
  const std::vector<DepthMetric> metrics{
      {.cap = 3, .one_sided = 2}, {.cap = 12, .one_sided = 8}, {.cap = 0.5f, .one_sided = 20}};
  constexpr std::uint32_t most = 4;
  for (const double hidden : {0.0, 0.4}) {
    const LeftOutFrames frames(source, 60, hidden);
    const auto best = best_of_others(source, frames, metrics, most, 1);
    std::vector<std::uint16_t> image(padded_cells(source.camera));
    for (std::size_t m = 0; m < metrics.size(); ++m)
      for (std::size_t frame = 0; frame < frames.size(); ++frame) {
        BestSamples expected(most);
        for (std::uint32_t s = 0; s < source.samples.size(); ++s) {
          if (source.samples[s].simulation == source.samples[frames.sample(frame)].simulation) continue;
          source.read_images(s, image);
          expected.offer(
              s, mean_square(kernels(), frames.observed(frame), image.data(), prices_of(metrics[m], source.camera)));
        }
        for (std::size_t k = 0; k < most; ++k) {
          const RankedSample found = best[m * frames.size() + frame].ranked()[k];
          REQUIRE(found.sample == expected.ranked()[k].sample);
          REQUIRE(found.distance == expected.ranked()[k].distance);
        }
      }
  }
}

TEST_CASE("a cached sample is the sample, and is read once") {
  const SampleSource source = discs();
  SampleSource counted = source;
  std::atomic<std::size_t> reads{0};
  counted.read_positions = [&](std::size_t sample, std::span<float> positions) {
    ++reads;
    source.read_positions(sample, positions);
  };
  const SampleSource cached = with_cache(counted);
  std::vector<std::uint16_t> image(padded_cells(source.camera)), expected = image, several(3 * image.size());
  for (int round = 0; round < 3; ++round)
    for (std::size_t s = 0; s < source.samples.size(); ++s) {
      cached.read_images(s, image);
      source.read_images(s, expected);
      REQUIRE(image == expected);
      const std::vector<float> chosen = cached.nodes_of(s);
      CHECK(chosen.size() <= 3 * 128);
      CHECK(chosen.front() == static_cast<float>(1000 * s));
    }
  CHECK(reads == source.samples.size());
  cached.read_images(7, several);
  source.read_images(9, expected);
  CHECK(std::equal(expected.begin(), expected.end(), several.end() - std::ssize(expected)));
}
