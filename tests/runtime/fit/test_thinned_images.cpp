// The proposal of samples by thinned images, among few and among many samples.
#include "runtime/src/depth/thinned_images.hpp"

#include <doctest/doctest.h>

#include <random>
#include <set>

using namespace lbea;

namespace {

/// A beam that is crushed from the right and folds outwards, in images with a depth step of 0.1 mm.
struct Beams {
  static constexpr std::uint32_t columns = 80, rows = 40;
  DepthCamera camera;
  std::vector<std::uint16_t> depths;
  std::mt19937 random{7};

  explicit Beams(std::size_t samples) {
    camera.columns = columns;
    camera.rows = rows;
    camera.depth_step = 0.1f;
    depths.assign(samples * padded_cells(camera), empty_cell);
    for (std::size_t s = 0; s < samples; ++s) add(std::span(depths).subspan(s * padded_cells(camera), columns * rows));
  }
  /// Of a beam that is crushed by up to 40 columns and folds by up to 50 mm, tilted by up to 20 mm.
  void add(std::span<std::uint16_t> image) {
    const auto between = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
    const double end = between(32, 72), place = between(8, 64), fold = between(0, 500), tilt = between(-5, 5);
    for (std::uint32_t row = 8; row < 32; ++row)
      for (std::uint32_t column = 4; column < end; ++column) {
        const double from = (column - place) / 6;
        image[row * columns + column] = static_cast<std::uint16_t>(2000 - fold * std::exp(-from * from) + tilt * row);
      }
  }
  [[nodiscard]] DepthImages images() const { return {.camera = camera, .depths = depths, .metric = {}}; }
  /// What a camera sees of another beam; hidden: columns from this one on are not_observed.
  [[nodiscard]] std::vector<float> frame(std::size_t hidden) {
    std::vector<std::uint16_t> image(padded_cells(camera), empty_cell);
    add(std::span(image).first(columns * rows));
    std::vector<float> frame(image.size(), nothing_seen);
    for (std::size_t cell = 0; cell < image.size(); ++cell)
      if (cell < columns * rows && cell % columns >= hidden)
        frame[cell] = not_observed;
      else if (image[cell] != empty_cell)
        frame[cell] = image[cell];
    return frame;
  }
};

/// All samples, most similar first: root mean squares over the observed cells, mm.
std::vector<RankedSample> ranked_plainly(const DepthImages& images, std::span<const float> frame) {
  const std::vector<std::uint32_t> cells = thinned_cells(images);
  std::vector<RankedSample> ranked;
  for (std::uint32_t s = 0; s < images.depths.size() / padded_cells(images.camera); ++s) {
    double squares = 0, filled = 0;
    for (const std::uint32_t cell : cells) {
      const std::uint16_t depth = images.of_sample(s)[cell];
      if (frame[cell] == not_observed || (depth == empty_cell && frame[cell] < 0)) continue;
      const bool both = depth != empty_cell && frame[cell] >= 0;
      const double difference = both ? std::abs(0.1 * (double{frame[cell]} - depth)) : 25;
      squares += std::pow(std::min(difference, 40.0), 2);
      ++filled;
    }
    ranked.push_back({s, static_cast<float>(std::sqrt(squares / std::max(filled, 1.0)))});
  }
  std::ranges::sort(ranked, is_before);
  return ranked;
}

std::set<std::uint32_t> compared_of(const ThinnedImages& thinned) {
  std::set<std::uint32_t> samples;
  thinned.visit_compared([&](std::uint32_t sample, float) { CHECK(samples.insert(sample).second); });
  return samples;
}

/// The best of the compared samples are proposed. Depths are compared in whole steps: a root mean square differs by
/// less than two of them, 0.2 mm.
void check_proposed(SelectedSamples& selected, const std::set<std::uint32_t>& compared,
                    std::span<const RankedSample> ranked) {
  std::set<std::uint32_t> proposed;
  for (const RankedSample& one : selected.selected(0)) proposed.insert(one.sample);
  CHECK(proposed.size() == std::min(selected.capacity(), compared.size()));
  float farthest = 0;
  for (const RankedSample& one : ranked)
    if (proposed.contains(one.sample)) farthest = one.distance;
  for (const RankedSample& one : ranked)
    if (compared.contains(one.sample) && !proposed.contains(one.sample)) CHECK(one.distance > farthest - 2 * 0.2f);
}

/// Of the distances of the best 24 among some samples.
template <class IsAmong>
float sum_of_best(std::span<const RankedSample> ranked, const IsAmong& is_among) {
  float sum = 0;
  std::size_t count = 0;
  for (const RankedSample& one : ranked)
    if (count < 24 && is_among(one.sample)) sum += one.distance, ++count;
  return sum;
}

}  // namespace

TEST_CASE("a frame is compared with each of few samples") {
  Beams beams(600);
  const DepthImages images = beams.images();
  ThinnedImages thinned(images);
  SelectedSamples selected(64);
  const std::vector<float> frame = beams.frame(Beams::columns);
  thinned.propose(frame, selected);
  const std::set<std::uint32_t> compared = compared_of(thinned);
  CHECK(compared.size() == 600);
  check_proposed(selected, compared, ranked_plainly(images, frame));
}

// Of 20,000 samples, at most 4,096 are compared, and before that one of each of 1,250 blocks. Their blocks are found
// whether the frame shows all of the beam or the left part.
TEST_CASE("of many samples, a frame is compared with nearly the most similar ones") {
  Beams beams(20'000);
  const DepthImages images = beams.images();
  ThinnedImages thinned(images);
  SelectedSamples selected(256);
  for (const std::uint32_t hidden : {Beams::columns, 30u}) {
    CAPTURE(hidden);
    float of_best = 0, of_compared = 0;
    for (std::size_t i = 0; i < 6; ++i) {
      const std::vector<float> frame = beams.frame(hidden);
      thinned.propose(frame, selected);
      const std::set<std::uint32_t> compared = compared_of(thinned);
      CHECK(compared.size() <= 4096);
      const std::vector<RankedSample> ranked = ranked_plainly(images, frame);
      check_proposed(selected, compared, ranked);
      of_best += sum_of_best(ranked, [](std::uint32_t) { return true; });
      of_compared += sum_of_best(ranked, [&](std::uint32_t sample) { return compared.contains(sample); });
    }
    CHECK(of_compared <= 1.1f * of_best);
  }
}
