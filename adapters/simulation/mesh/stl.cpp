#include "adapters/files/stl_corners.hpp"
#include "adapters/simulation/grid/grid.hpp"

namespace lbea::io::grid {
/// Binary when the number of triangles matches the file's size, whatever the file begins with; else text when it begins
/// with "solid" and has a "facet".
bool is_stl(const std::filesystem::path& file, std::string_view start) {
  std::error_code error;
  const auto bytes = std::filesystem::file_size(file, error);
  return (!error && stl::is_binary(start, bytes)) || stl::is_text(start);
}

Grid parse_stl(std::string_view bytes, const std::string& name) {
  Grid grid;
  grid.is_triangle_soup = true;
  grid.positions = stl::corners(bytes, name);
  for (std::uint32_t point = 0; point + 2 < grid.points(); point += 3)
    grid.cells.add(CellKind::triangle, std::array{point, point + 1, point + 2});
  return grid;
}
}  // namespace lbea::io::grid
