#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/stl_corners.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::io {
bool is_stl(std::string_view start, std::size_t bytes) noexcept {
  return stl::is_binary(start, bytes) || stl::is_text(start);
}

/// The corners of the triangles, each position once, in the order of the file.
PointCloud parse_stl(std::span<const std::byte> bytes, const std::string& name) {
  const std::vector<float> corners = stl::corners(as_text(bytes), name);
  const auto corner = [&](std::size_t i) { return std::array{corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]}; };
  std::vector<std::size_t> order(corners.size() / 3);
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::sort(order.begin(), order.end(),
            [&](std::size_t a, std::size_t b) { return std::pair(corner(a), a) < std::pair(corner(b), b); });
  std::vector<std::uint8_t> is_first(order.size(), 0);
  for (std::size_t i = 0; i < order.size(); ++i)
    is_first[order[i]] = i == 0 || corner(order[i]) != corner(order[i - 1]) ? 1 : 0;
  PointCloud cloud;
  cloud.source = name;
  for (std::size_t i = 0; i < is_first.size(); ++i)
    if (is_first[i]) cloud.points.push_back({corners[3 * i], corners[3 * i + 1], corners[3 * i + 2]});
  return cloud;
}
}  // namespace lbea::io
