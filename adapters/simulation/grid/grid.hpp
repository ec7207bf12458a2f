// The contents of a mesh file of any format: points, cells and their values, of one state or of all states of a run.
#pragma once

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::io::grid {
/// Kinds of cells, with VTK's numbers. Cells of higher order list their corners first.
enum class CellKind : std::uint8_t {
  vertex = 1,
  poly_vertex = 2,
  line = 3,
  poly_line = 4,
  triangle = 5,
  triangle_strip = 6,
  polygon = 7,
  pixel = 8,
  quad = 9,
  tetrahedron = 10,
  voxel = 11,
  hexahedron = 12,
  wedge = 13,
  pyramid = 14,
  quadratic_line = 21,
  quadratic_triangle = 22,
  quadratic_quad = 23,
  quadratic_tetrahedron = 24,
  quadratic_hexahedron = 25,
  quadratic_wedge = 26,
  quadratic_pyramid = 27,
  biquadratic_quad = 28,
  triquadratic_hexahedron = 29
};

/// What a cell contributes to the surface. `flat` and `solid` cells have fixed corners.
enum class CellForm { none, flat, strip, polygon, solid };

struct CellShape {
  CellKind kind;
  std::size_t least_points;  // of such a cell
  CellForm form;
  std::array<std::uint8_t, 8> corners;  // of a quad (the first 4) or a hexahedron, as positions among the cell's points
};

/// nullptr for a kind that is not in CellKind.
[[nodiscard]] const CellShape* shape_of(CellKind kind) noexcept;

struct Cells {
  std::vector<std::uint32_t> points;   // of all cells, one after the other
  std::vector<std::uint64_t> ends{0};  // cells + 1: where each cell's points end
  std::vector<CellKind> kinds;         // cells

  [[nodiscard]] std::size_t size() const noexcept { return kinds.size(); }
  [[nodiscard]] std::span<const std::uint32_t> operator[](std::size_t cell) const {
    return std::span(points).subspan(ends[cell], ends[cell + 1] - ends[cell]);
  }
  void add(CellKind kind, std::span<const std::uint32_t> corners) {
    points.insert(points.end(), corners.begin(), corners.end());
    ends.push_back(points.size());
    kinds.push_back(kind);
  }
  bool operator==(const Cells&) const = default;
};

struct Array {
  std::string name;
  std::size_t components = 1;
  std::vector<double> values;  // rows x components
};

struct Grid {
  std::vector<float> positions;  // points x 3
  Cells cells;
  std::vector<Array> point_arrays, cell_arrays;
  std::optional<double> time;             // in the file's unit
  bool is_triangle_soup = false;          // no two triangles share points; equal coordinates mean the same node
  std::vector<std::uint32_t> piece_ends;  // where the points of each piece end, when the mesh is in pieces

  [[nodiscard]] std::size_t points() const noexcept { return positions.size() / 3; }
};

/// The two functions of a format: whether a file that begins with `start` has it, and the parser, which throws
/// Error{bad_input | unsupported_input} that names the file and the line or byte.
using IsFormat = bool(std::string_view start) noexcept;
using ParseGrid = Grid(std::string_view bytes, const std::string& name);

/// Reads one file. Throws Error{file_not_found | bad_input | unsupported_input}.
using ReadGrid = Grid (*)(const std::filesystem::path& file);

/// The other files that a file names as parts of itself. Throws like ReadGrid.
using ListParts = std::vector<std::filesystem::path> (*)(const std::filesystem::path& file);

/// The array of this name, ignoring case; nullptr when there is none.
[[nodiscard]] const Array* find_array(const std::vector<Array>& arrays, const std::string& name);

/// Checks the sizes of arrays, and that every cell refers to existing points and has as many as its kind needs.
/// Throws Error{bad_input} that names file and cell.
void check_grid(const Grid& grid, const std::string& file);
}  // namespace lbea::io::grid
