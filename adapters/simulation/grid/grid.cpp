#include "adapters/simulation/grid/grid.hpp"

#include "adapters/files/text_line.hpp"

#include <algorithm>

namespace lbea::io::grid {
namespace {
using Corners = std::array<std::uint8_t, 8>;
constexpr Corners triangle{0, 1, 2, 2}, four_corners{0, 1, 2, 3}, tetrahedron{0, 1, 2, 3, 3, 3, 3, 3},
    pyramid{0, 1, 2, 3, 4, 4, 4, 4}, wedge{0, 1, 2, 2, 3, 4, 5, 5}, hexahedron{0, 1, 2, 3, 4, 5, 6, 7};

constexpr std::array cell_shapes{
    CellShape{CellKind::vertex, 0, CellForm::none, {}},
    CellShape{CellKind::poly_vertex, 0, CellForm::none, {}},
    CellShape{CellKind::line, 0, CellForm::none, {}},
    CellShape{CellKind::poly_line, 0, CellForm::none, {}},
    CellShape{CellKind::triangle, 3, CellForm::flat, triangle},
    CellShape{CellKind::triangle_strip, 3, CellForm::strip, {}},
    CellShape{CellKind::polygon, 3, CellForm::polygon, {}},
    CellShape{CellKind::pixel, 4, CellForm::flat, {0, 1, 3, 2}},
    CellShape{CellKind::quad, 4, CellForm::flat, four_corners},
    CellShape{CellKind::tetrahedron, 4, CellForm::solid, tetrahedron},
    CellShape{CellKind::voxel, 8, CellForm::solid, {0, 1, 3, 2, 4, 5, 7, 6}},
    CellShape{CellKind::hexahedron, 8, CellForm::solid, hexahedron},
    CellShape{CellKind::wedge, 6, CellForm::solid, wedge},
    CellShape{CellKind::pyramid, 5, CellForm::solid, pyramid},
    CellShape{CellKind::quadratic_line, 0, CellForm::none, {}},
    CellShape{CellKind::quadratic_triangle, 6, CellForm::flat, triangle},
    CellShape{CellKind::quadratic_quad, 8, CellForm::flat, four_corners},
    CellShape{CellKind::quadratic_tetrahedron, 10, CellForm::solid, tetrahedron},
    CellShape{CellKind::quadratic_hexahedron, 20, CellForm::solid, hexahedron},
    CellShape{CellKind::quadratic_wedge, 15, CellForm::solid, wedge},
    CellShape{CellKind::quadratic_pyramid, 13, CellForm::solid, pyramid},
    CellShape{CellKind::biquadratic_quad, 9, CellForm::flat, four_corners},
    CellShape{CellKind::triquadratic_hexahedron, 27, CellForm::solid, hexahedron},
};

void check_arrays(const std::vector<Array>& arrays, std::size_t rows, const char* what, const std::string& file) {
  for (const Array& array : arrays)
    if (array.components == 0 || array.values.size() / array.components != rows ||
        array.values.size() % array.components != 0)
      throw Error{Status::bad_input, file + ": array \"" + array.name + "\" has " +
                                         std::to_string(array.values.size()) + " values of " +
                                         std::to_string(array.components) + " components for " + std::to_string(rows) +
                                         " " + what + "; the file is damaged, export it again"};
}

}  // namespace

const CellShape* shape_of(CellKind kind) noexcept {
  const auto found = std::ranges::find(cell_shapes, kind, &CellShape::kind);
  return found == cell_shapes.end() ? nullptr : &*found;
}

const Array* find_array(const std::vector<Array>& arrays, const std::string& name) {
  const auto letters = [](const Array& array) { return text::lower(array.name); };
  const auto found = std::ranges::find(arrays, text::lower(name), letters);
  return found == arrays.end() ? nullptr : &*found;
}

void check_grid(const Grid& grid, const std::string& file) {
  const auto refuse = [&](std::size_t cell, const std::string& what) {
    throw Error{Status::bad_input,
                file + ", cell " + std::to_string(cell) + ": " + what + "; the file is damaged, export it again"};
  };
  for (std::size_t c = 0; c < grid.cells.size(); ++c) {
    const auto points = grid.cells[c];
    const CellShape* const shape = shape_of(grid.cells.kinds[c]);
    if (shape != nullptr && points.size() < shape->least_points)
      refuse(c, "has " + std::to_string(points.size()) + " points, too few for cells of kind " +
                    std::to_string(static_cast<int>(grid.cells.kinds[c])));
    for (const std::uint32_t point : points)
      if (point >= grid.points())
        refuse(c, "names point " + std::to_string(point) + ", but there are " + std::to_string(grid.points()));
  }
  check_arrays(grid.point_arrays, grid.points(), "points", file);
  check_arrays(grid.cell_arrays, grid.cells.size(), "cells", file);
}
}  // namespace lbea::io::grid
