#include "adapters/simulation/vtkhdf/packed_grid.hpp"

namespace lbea::io::vtkhdf {
namespace {
void add_arrays(const std::vector<grid::Array>& arrays, child::Packer& into) {
  const std::uint64_t count = arrays.size();
  into.add(std::span(&count, 1));
  for (const grid::Array& array : arrays) {
    const std::uint64_t components = array.components;
    into.add(std::span<const char>(array.name));
    into.add(std::span(&components, 1));
    into.add(std::span(array.values));
  }
}

std::uint64_t next_number(child::Unpacker& from) { return from.next<std::uint64_t>().at(0); }

std::vector<grid::Array> next_arrays(child::Unpacker& from) {
  std::vector<grid::Array> arrays;
  for (std::uint64_t left = next_number(from); left > 0; --left) {
    const auto name = from.next<char>();
    const std::uint64_t components = next_number(from);
    arrays.push_back({std::string(name.begin(), name.end()), components, from.next<double>()});
  }
  return arrays;
}
}  // namespace

child::Bytes packed(const grid::Grid& grid) {
  child::Packer into;
  into.add(std::span(grid.positions));
  into.add(std::span(grid.cells.points));
  into.add(std::span(grid.cells.ends));
  into.add(std::span(grid.cells.kinds));
  into.add(std::span(grid.piece_ends));
  add_arrays(grid.point_arrays, into);
  add_arrays(grid.cell_arrays, into);
  return into.take();
}

grid::Grid unpacked(const child::Bytes& bytes) {
  child::Unpacker from(bytes);
  grid::Grid grid;
  grid.positions = from.next<float>();
  const auto points = from.next<std::uint32_t>();
  const auto ends = from.next<std::uint64_t>();
  const auto kinds = from.next<grid::CellKind>();
  grid.piece_ends = from.next<std::uint32_t>();
  if (ends.size() != kinds.size() + 1) throw std::out_of_range("cells");
  for (std::size_t c = 0; c < kinds.size(); ++c) {
    if (ends[c] > ends[c + 1] || ends[c + 1] > points.size()) throw std::out_of_range("cells");
    grid.cells.add(kinds[c], std::span(points).subspan(ends[c], ends[c + 1] - ends[c]));
  }
  std::uint32_t before = 0;
  for (const std::uint32_t end : grid.piece_ends)
    if (end < std::exchange(before, end) || end > grid.points()) throw std::out_of_range("pieces");
  grid.point_arrays = next_arrays(from);
  grid.cell_arrays = next_arrays(from);
  return grid;
}
}  // namespace lbea::io::vtkhdf
