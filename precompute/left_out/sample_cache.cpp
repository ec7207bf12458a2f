#include "precompute/left_out/sample_cache.hpp"

#include "precompute/left_out/branches.hpp"

#include <algorithm>
#include <array>
#include <mutex>

namespace lbea::bake {
namespace {

constexpr std::size_t most_bytes = std::size_t{64} << 20;
constexpr std::size_t most_nodes = 128;  // at which shapes are compared

/// One place per sample or, of many samples, for every k-th: the last one read is kept.
class Cache {
 public:
  explicit Cache(const SampleSource& source)
      : source_(source),
        cells_(padded_cells(source.camera)),
        coordinates_(thinned_nodes(std::vector<float>(3 * source.nodes), most_nodes).size()),
        all_coordinates_(coordinates_ + 3 * source.surface.between.size()),
        samples_(
            std::clamp<std::size_t>(most_bytes / (cells_ * sizeof(std::uint16_t) + all_coordinates_ * sizeof(float)), 1,
                                    std::max<std::size_t>(source.samples.size(), 1)),
            none),
        images_(samples_.size() * cells_),
        nodes_(samples_.size() * all_coordinates_) {}

  void read_image(std::size_t sample, std::span<std::uint16_t> image) {
    const std::lock_guard lock(mutex_of(sample));
    std::ranges::copy(std::span(images_).subspan(place_of(sample) * cells_, cells_), image.begin());
  }
  [[nodiscard]] std::vector<float> nodes(std::size_t sample) { return coordinates(sample, 0, coordinates_); }
  [[nodiscard]] std::vector<float> surface(std::size_t sample) {
    return coordinates(sample, coordinates_, all_coordinates_);
  }

 private:
  static constexpr std::size_t none = std::numeric_limits<std::size_t>::max();

  std::mutex& mutex_of(std::size_t sample) { return mutexes_[sample % samples_.size() % mutexes_.size()]; }

  [[nodiscard]] std::vector<float> coordinates(std::size_t sample, std::size_t begin, std::size_t end) {
    const std::lock_guard lock(mutex_of(sample));
    const auto from = nodes_.begin() + static_cast<std::ptrdiff_t>(place_of(sample) * all_coordinates_);
    return {from + static_cast<std::ptrdiff_t>(begin), from + static_cast<std::ptrdiff_t>(end)};
  }

  /// Reads the sample unless it is there. The caller holds its mutex.
  std::size_t place_of(std::size_t sample) {
    const std::size_t place = sample % samples_.size();
    if (samples_[place] == sample) return place;
    samples_[place] = none;
    source_.read_images(sample, std::span(images_).subspan(place * cells_, cells_));
    std::vector<float> positions(3 * source_.nodes);
    source_.read_positions(sample, positions);
    auto into = nodes_.begin() + static_cast<std::ptrdiff_t>(place * all_coordinates_);
    into = std::ranges::copy(thinned_nodes(positions, most_nodes), into).out;
    for (const auto& [a, b] : source_.surface.between)
      into =
          std::ranges::copy(SurfacePlaces::middle(&positions[std::size_t{3} * a], &positions[std::size_t{3} * b]), into)
              .out;
    samples_[place] = sample;
    return place;
  }

  const SampleSource& source_;
  std::size_t cells_, coordinates_, all_coordinates_;  // of the thinned nodes; with those of the surface
  std::vector<std::size_t> samples_;                   // per place
  std::vector<std::uint16_t> images_;
  std::vector<float> nodes_;
  std::array<std::mutex, 64> mutexes_;
};

}  // namespace

SampleSource with_cache(const SampleSource& source) {
  const auto cache = std::make_shared<Cache>(source);
  SampleSource cached = source;
  cached.read_images = [&source, cache](std::size_t first, std::span<std::uint16_t> images) {
    if (images.size() == padded_cells(source.camera))
      cache->read_image(first, images);
    else
      source.read_images(first, images);
  };
  cached.nodes_of = [cache](std::size_t sample) { return cache->nodes(sample); };
  cached.surface_of = [cache](std::size_t sample) { return cache->surface(sample); };
  return cached;
}

}  // namespace lbea::bake
