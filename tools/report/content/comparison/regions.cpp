#include "tools/report/content/frame_study.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace lbea::tool {
namespace {

using Elements = std::span<const std::array<std::uint32_t, 4>>;
using Center = std::array<double, 3>;
constexpr std::size_t most_regions = 32, fewest_elements = 8, listed = 3;
constexpr std::uint32_t fewest_points = 10;  // of a region in a frame

std::vector<Center> centers_of(std::span<const float> positions, Elements elements) {
  std::vector<Center> centers;
  centers.reserve(elements.size());
  for (const auto& nodes : elements) {
    Center center{};
    for (const std::uint32_t node : nodes)
      for (std::size_t k = 0; k < 3; ++k) center[k] += 0.25 * double{positions[3 * std::size_t{node} + k]};
    centers.push_back(center);
  }
  return centers;
}

/// Divides elements at the median of their longest direction, again and again.
class Division {
 public:
  explicit Division(std::span<const Center> centers) : centers_(centers), order_(centers.size()) {
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    divide(order_, most_regions);
  }
  [[nodiscard]] const std::vector<std::span<std::size_t>>& regions() const noexcept { return regions_; }

 private:
  void divide(std::span<std::size_t> elements, std::size_t parts) {
    if (elements.empty()) return;
    if (parts <= 1 || elements.size() < 2 * fewest_elements) return regions_.push_back(elements);
    const std::size_t direction = longest(elements), half = elements.size() / 2;
    std::ranges::nth_element(elements, elements.begin() + static_cast<std::ptrdiff_t>(half), {},
                             [&](std::size_t e) { return centers_[e][direction]; });
    divide(elements.first(half), parts / 2);
    divide(elements.subspan(half), parts - parts / 2);
  }
  [[nodiscard]] std::size_t longest(std::span<const std::size_t> elements) const {
    std::array<double, 3> extents{};
    for (std::size_t k = 0; k < 3; ++k) {
      const auto [low, high] = std::ranges::minmax(elements, {}, [&](std::size_t e) { return centers_[e][k]; });
      extents[k] = centers_[high][k] - centers_[low][k];
    }
    return static_cast<std::size_t>(std::ranges::max_element(extents) - extents.begin());
  }
  std::span<const Center> centers_;
  std::vector<std::size_t> order_;
  std::vector<std::span<std::size_t>> regions_;
};

/// Mean distance of the points on these elements in a frame; NaN for too few points.
double distance_in(const CloudComparison& comparison, std::span<const std::size_t> elements) {
  double sum = 0;
  std::uint32_t points = 0;
  for (const std::size_t e : elements)
    if (const std::uint32_t count = comparison.element_points()[e]; count > 0) {
      sum += double{comparison.element_distances()[e]} * count;
      points += count;
    }
  return points < fewest_points ? double{CloudComparison::unknown} : sum / points;
}

std::uint32_t commonest_part(const Model& model, std::span<const std::size_t> elements) {
  std::map<std::uint32_t, std::size_t> counts;
  for (const std::size_t e : elements) ++counts[model.element_parts()[e]];
  return std::ranges::max_element(counts, {}, [](const auto& count) { return count.second; })->first;
}

/// Nothing for a region that less than a third of the frames show.
std::optional<Region> region_of(const Model& model, const FrameStudy& study, std::span<const std::size_t> elements,
                                std::span<const Center> centers) {
  Region region;
  std::size_t frames = 0;
  for (const StudiedFrame& frame : study.frames) {
    const double distance = distance_in(frame.to_estimate, elements);
    if (!std::isfinite(distance)) continue;
    ++frames;
    region.mean += distance;
    if (distance < region.highest) continue;
    region.highest = distance;
    region.highest_time_s = frame.time_s;
  }
  if (frames == 0 || 3 * frames < study.frames.size()) return std::nullopt;
  region.mean /= static_cast<double>(frames);
  Center center{};
  for (const std::size_t e : elements)
    for (std::size_t k = 0; k < 3; ++k) center[k] += centers[e][k] / static_cast<double>(elements.size());
  region.center = {static_cast<float>(center[0]), static_cast<float>(center[1]), static_cast<float>(center[2])};
  region.part = commonest_part(model, elements);
  return region;
}

std::vector<float> mean_element_distances(const FrameStudy& study) {
  std::vector<float> means(study.elements.size(), CloudComparison::unknown);
  for (std::size_t e = 0; e < means.size(); ++e) {
    double sum = 0;
    std::uint64_t points = 0;
    for (const StudiedFrame& frame : study.frames)
      if (const std::uint32_t count = frame.to_estimate.element_points()[e]; count > 0) {
        sum += double{frame.to_estimate.element_distances()[e]} * count;
        points += count;
      }
    if (points > 0) means[e] = static_cast<float>(sum / static_cast<double>(points));
  }
  return means;
}

}  // namespace

RegionMap regions_of(const Model& model, const FrameStudy& study) {
  RegionMap map;
  if (study.frames.empty()) return map;
  const Sample match =
      study.frames.back().result.matches.empty() ? Sample{} : study.frames.back().result.matches.front().sample;
  std::uint32_t initial = model.sample_index({match.simulation, 0});
  if (initial >= model.samples()) initial = 0;
  const auto positions = model.node_positions(initial);
  map.initial.assign(positions.begin(), positions.end());
  map.element_distances = mean_element_distances(study);
  const std::vector<Center> centers = centers_of(positions, study.elements);
  const Division division(centers);
  for (const auto& elements : division.regions())
    if (const auto region = region_of(model, study, elements, centers)) map.worst.push_back(*region);
  std::ranges::sort(map.worst, std::ranges::greater(), &Region::mean);
  if (map.worst.size() > listed) map.worst.resize(listed);
  return map;
}

}  // namespace lbea::tool
