#include "adapters/simulation/grid/pieces.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::io::grid {
namespace {
[[noreturn]] void refuse_piece(const std::string& file, const std::string& what) {
  throw Error{Status::bad_input, file + what};
}

/// The flags by which pieces mark what they repeat of their neighbors: VTK's since version 7, and the earlier ones.
bool is_ghost_array(const Array& array) { return array.name == "vtkGhostType" || array.name == "vtkGhostLevels"; }

/// Bits of vtkGhostType: 1 repeats a cell of another piece, 32 is hidden.
bool is_ghost(const Array& flags, std::size_t cell) {
  const double flag = flags.values[cell];
  if (flags.name == "vtkGhostLevels") return flag > 0;
  return flag > 0 && flag < 256 && (static_cast<int>(flag) & (1 | 32)) != 0;
}

/// Adds the cells that are not ghosts; returns which they are.
std::vector<std::size_t> add_cells(const Grid& piece, Grid& whole) {
  const auto flags = std::ranges::find_if(piece.cell_arrays, is_ghost_array);
  const auto first_point = static_cast<std::uint32_t>(whole.points());
  std::vector<std::size_t> kept;
  std::vector<std::uint32_t> corners;
  for (std::size_t c = 0; c < piece.cells.size(); ++c) {
    if (flags != piece.cell_arrays.end() && is_ghost(*flags, c)) continue;
    corners.assign(piece.cells[c].begin(), piece.cells[c].end());
    for (std::uint32_t& corner : corners) corner += first_point;
    whole.cells.add(piece.cells.kinds[c], corners);
    kept.push_back(c);
  }
  return kept;
}

/// Appends the rows `kept` of an array.
void append(const Array& from, const std::vector<std::size_t>& kept, Array& into) {
  for (const std::size_t row : kept) {
    const auto at = from.values.begin() + static_cast<std::ptrdiff_t>(row * from.components);
    into.values.insert(into.values.end(), at, at + static_cast<std::ptrdiff_t>(from.components));
  }
}

/// Pieces without rows may lack arrays; all others must have the same ones.
void add_arrays(const std::vector<Array>& piece, const std::vector<std::size_t>& kept, std::size_t rows_before,
                const std::string& file, std::vector<Array>& whole) {
  if (kept.empty()) return;
  for (const Array& array : piece) {
    if (is_ghost_array(array)) continue;
    auto into = std::ranges::find(whole, array.name, &Array::name);
    if (into == whole.end() && rows_before == 0) into = whole.insert(whole.end(), {array.name, array.components, {}});
    if (into == whole.end() || into->components != array.components)
      refuse_piece(file, ": its array \"" + array.name + "\" is not that of the earlier pieces; export it again");
    append(array, kept, *into);
  }
  for (const Array& array : whole)
    if (array.values.size() != (rows_before + kept.size()) * array.components)
      refuse_piece(file, ": has no array \"" + array.name + "\", but earlier pieces have; export it again");
}

}  // namespace

void add_piece(const Grid& piece, const std::string& file, Grid& whole) {
  if (whole.points() + piece.points() > 0xffffffffu) refuse_piece(file, ": the pieces have too many points");
  const std::size_t cells_before = whole.cells.size();
  std::vector<std::size_t> points(piece.points());
  std::iota(points.begin(), points.end(), std::size_t{0});
  const std::vector<std::size_t> cells = add_cells(piece, whole);
  add_arrays(piece.point_arrays, points, whole.points(), file, whole.point_arrays);
  add_arrays(piece.cell_arrays, cells, cells_before, file, whole.cell_arrays);
  whole.positions.insert(whole.positions.end(), piece.positions.begin(), piece.positions.end());
  whole.piece_ends.push_back(static_cast<std::uint32_t>(whole.points()));
  if (!whole.time) whole.time = piece.time;
}

}  // namespace lbea::io::grid
