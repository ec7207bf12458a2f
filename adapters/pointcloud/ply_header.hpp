// The header of a PLY file: which elements follow, in which order, made of which properties.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::pointcloud {

enum class PlyFormat { ascii, little_endian, big_endian };
enum class PlyScalar { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

[[nodiscard]] std::size_t size_of(PlyScalar type) noexcept;  // bytes

struct PlyProperty {
  std::string name;
  PlyScalar type = PlyScalar::float32;
  std::optional<PlyScalar> count_type;  // of a list: an integer that says how many values follow
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;  // rows, as declared: not yet held against the file's size
  std::vector<PlyProperty> properties;
};

struct PlyHeader {
  PlyFormat format = PlyFormat::ascii;
  std::vector<PlyElement> elements;
  std::optional<std::int64_t> stamp_ns;
  std::size_t bytes = 0;  // length of the header
  std::size_t lines = 0;
};

/// Throws Error{bad_input | unsupported_input} with the line.
[[nodiscard]] PlyHeader parse_ply_header(std::string_view text, const std::string& name);

}  // namespace lbea::pointcloud
