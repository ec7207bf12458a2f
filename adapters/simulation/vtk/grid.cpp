#include "adapters/simulation/vtk/grid.hpp"

#include <algorithm>
#include <cctype>

namespace lbea::io::grid {
namespace {

std::size_t least_points(CellKind kind) {
  switch (kind) {
    case CellKind::triangle:
    case CellKind::triangle_strip:
    case CellKind::polygon:
      return 3;
    case CellKind::quad:
    case CellKind::pixel:
    case CellKind::tetrahedron:
      return 4;
    case CellKind::pyramid:
      return 5;
    case CellKind::wedge:
    case CellKind::quadratic_triangle:
      return 6;
    case CellKind::voxel:
    case CellKind::hexahedron:
    case CellKind::quadratic_quad:
      return 8;
    case CellKind::biquadratic_quad:
      return 9;
    case CellKind::quadratic_tetrahedron:
      return 10;
    case CellKind::quadratic_pyramid:
      return 13;
    case CellKind::quadratic_wedge:
      return 15;
    case CellKind::quadratic_hexahedron:
      return 20;
    case CellKind::triquadratic_hexahedron:
      return 27;
    default:
      return 0;
  }
}

void check_arrays(const std::vector<Array>& arrays, std::size_t rows, const char* what, const std::string& file) {
  for (const Array& array : arrays)
    if (array.components == 0 || array.values.size() / array.components != rows ||
        array.values.size() % array.components != 0)
      throw Error{Status::bad_input, file + ": array \"" + array.name + "\" has " +
                                         std::to_string(array.values.size()) + " values of " +
                                         std::to_string(array.components) + " components for " + std::to_string(rows) +
                                         " " + what + "; the file is damaged, export it again"};
}

bool equal_letters(char a, char b) {
  return std::tolower(static_cast<unsigned char>(a)) == std::tolower(static_cast<unsigned char>(b));
}

}  // namespace

const Array* find_array(const std::vector<Array>& arrays, const std::string& name) {
  const auto found = std::find_if(arrays.begin(), arrays.end(), [&](const Array& array) {
    return std::equal(array.name.begin(), array.name.end(), name.begin(), name.end(), equal_letters);
  });
  return found == arrays.end() ? nullptr : &*found;
}

void check_grid(const Grid& grid, const std::string& file) {
  const auto refuse = [&](std::size_t cell, const std::string& what) {
    throw Error{Status::bad_input,
                file + ", cell " + std::to_string(cell) + ": " + what + "; the file is damaged, export it again"};
  };
  for (std::size_t c = 0; c < grid.cells.size(); ++c) {
    const auto points = grid.cells[c];
    if (points.size() < least_points(grid.cells.kinds[c]))
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
