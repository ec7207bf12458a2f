#include "runtime/src/match/crowded_cells.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

namespace lbea {
namespace {

constexpr std::uint32_t least_limit = 128, limits_per_cloud = 256;
constexpr std::uint32_t limits_per_division = 4;  // smaller cells cost less in a search than ordered
constexpr std::size_t most_passes = 2;            // on average over the points of a cloud
constexpr float least_resolution = 1e-30f;        // keeps its inverse finite
constexpr std::array<std::uint32_t, 16> spread_bits{0x000, 0x001, 0x008, 0x009, 0x040, 0x041, 0x048, 0x049,
                                                    0x200, 0x201, 0x208, 0x209, 0x240, 0x241, 0x248, 0x249};

using Four = std::array<float, 4>;  // x, y, z; the fourth is meaningless and fills a register

PlacedPoint point_at(const std::byte* points, std::size_t i) noexcept {
  PlacedPoint point;
  std::memcpy(&point, points + i * sizeof(point), sizeof(point));
  return point;
}

struct Box {
  Four low, high;

  [[nodiscard]] float extent() const noexcept {
    return std::max({high[0] - low[0], high[1] - low[1], high[2] - low[2]});
  }
};

Box box_of(const std::byte* points, std::size_t count) noexcept {
  const auto position = [&](std::size_t i) {
    const PlacedPoint point = point_at(points, i);
    return Four{point.x, point.y, point.z, 0};
  };
  Box box{position(0), position(0)};
  for (std::size_t i = 1; i < count; ++i) {
    const Four p = position(i);
    for (std::size_t axis = 0; axis < 4; ++axis) {
      box.low[axis] = std::min(box.low[axis], p[axis]);
      box.high[axis] = std::max(box.high[axis], p[axis]);
    }
  }
  return box;
}

}  // namespace

CrowdedCells::CrowdedCells(std::uint32_t max_points) {
  ranges_.reserve((most_passes + 1) * (max_points / least_limit));
}

std::uint32_t CrowdedCells::limit(std::size_t points) noexcept {
  return std::max(least_limit, static_cast<std::uint32_t>(points / limits_per_cloud));
}

void CrowdedCells::sort(std::span<std::byte> points, PlacedPoint* spare, std::uint32_t* keys,
                        float resolution) noexcept {
  const std::size_t count = points.size() / sizeof(PlacedPoint);
  const std::uint32_t least = limits_per_division * limit(count);
  std::size_t work = most_passes * count;
  for (std::size_t next = 0; next < ranges_.size(); ++next) {  // divide() adds ranges
    const Range range = ranges_[next];
    if (range.count <= least) continue;
    if (range.count > work) return;
    work -= range.count;
    divide(points.data() + range.begin * sizeof(PlacedPoint), range, spare, keys,
           std::max(resolution, least_resolution));
  }
}

// A counting sort by the cells of a grid over the box of the points.
void CrowdedCells::divide(std::byte* points, Range range, PlacedPoint* spare, std::uint32_t* keys,
                          float resolution) noexcept {
  const Box box = box_of(points, range.count);
  if (!(box.extent() > resolution)) return;
  const float scale = static_cast<float>(1u << bits) / box.extent();
  const auto along = [&](float position, std::size_t axis) {
    return spread_bits[std::min(static_cast<std::uint32_t>((position - box.low[axis]) * scale), (1u << bits) - 1)];
  };
  std::ranges::fill(ends_, 0u);
  for (std::size_t i = 0; i < range.count; ++i) {
    const PlacedPoint p = point_at(points, i);
    keys[i] = along(p.x, 0) | along(p.y, 1) << 1 | along(p.z, 2) << 2;
    ++ends_[keys[i]];
  }
  std::uint32_t begin = 0;
  for (std::uint32_t& end : ends_) {
    if (end > least_limit) add(range.begin + begin, end);
    begin += std::exchange(end, begin);
  }
  for (std::size_t i = 0; i < range.count; ++i) spare[ends_[keys[i]]++] = point_at(points, i);
  std::memcpy(points, spare, range.count * sizeof(PlacedPoint));
}

}  // namespace lbea
