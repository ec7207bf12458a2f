#include "adapters/simulation/mesh/stl_mesh.hpp"

#include <array>

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/stl_corners.hpp"

namespace lbea::io::grid {

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

Grid read_stl(const std::filesystem::path& file) { return parse_stl(as_text(read_file(file)), file.string()); }

}  // namespace lbea::io::grid
