// The corners of the triangles of an STL file, for readers of meshes and of clouds.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io::stl {
/// Whether a file that begins with `start` is binary STL: its number of triangles matches its size.
[[nodiscard]] bool is_binary(std::string_view start, std::uint64_t file_bytes) noexcept;
/// Whether a file that begins with `start` is text STL.
[[nodiscard]] bool is_text(std::string_view start) noexcept;

/// Triangles x 3 corners x 3 coordinates, in file order. Throws Error{bad_input} with line or byte.
[[nodiscard]] std::vector<float> corners(std::string_view bytes, const std::string& name);
}  // namespace lbea::io::stl
