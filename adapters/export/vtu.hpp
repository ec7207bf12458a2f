// Meshes with fields for ParaView: one .vtu per state, and a .pvd that lists them with their times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>
#include <string>
#include <variant>
#include <vector>

namespace lbea::io {
/// Values per point or per cell, `components` in a row for each.
struct VtuArray {
  std::string name;
  std::variant<std::span<const float>, std::span<const std::uint32_t>> values;
  std::uint32_t components = 1;
};

/// Spans: the caller keeps the values alive while write_vtu() runs.
struct VtuGrid {
  std::span<const float> positions;              // points x 3
  std::span<const std::uint32_t> element_nodes;  // cells x 4, point indices; a triangle repeats its last node
  std::vector<VtuArray> point_arrays;
  std::vector<VtuArray> cell_arrays;
  std::optional<double> time_s;
};

/// Writes an unstructured grid of quads and triangles, with raw little-endian data after the XML.
/// Throws Error{bad_config} for sizes, indices or names that do not fit, Error{write_failed}.
void write_vtu(const std::filesystem::path& path, const VtuGrid& grid);

struct PvdEntry {
  double time_s = 0;
  std::filesystem::path file;
};

/// Writes the collection; files are named relative to its folder, so the folder may be moved.
/// Throws Error{bad_config} for a time that is not finite or a file without a name, Error{write_failed}.
void write_pvd(const std::filesystem::path& path, std::span<const PvdEntry> entries);
}  // namespace lbea::io
