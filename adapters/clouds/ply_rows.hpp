// The rows of a PLY file after its header, down to the points.
#pragma once

#include "adapters/files/ply_header.hpp"

#include <lbea/lbea.hpp>

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace lbea::io::clouds {

inline constexpr std::size_t no_axis = 3;
/// 0, 1, 2 for the properties x, y, z; no_axis for any other.
[[nodiscard]] std::size_t axis_of(const ply::Property& property) noexcept;

/// The points of the element "vertex"; the elements before it are skipped, those after it not looked at.
/// `bytes` is the whole file. Throws Error{bad_input} with line or byte.
[[nodiscard]] std::vector<Point> read_ascii_points(std::span<const std::byte> bytes, const ply::Header& header,
                                                   const std::string& name);
[[nodiscard]] std::vector<Point> read_binary_points(std::span<const std::byte> bytes, const ply::Header& header,
                                                    const std::string& name);

template <class Rows>
std::vector<Point> read_points(Rows rows, const std::vector<ply::Element>& elements) {
  for (const ply::Element& element : elements) {
    if (element.name == "vertex") return rows.read(element);
    rows.skip(element);
  }
  return {};
}

}  // namespace lbea::io::clouds
