#include "adapters/simulation/grid/pieces.hpp"
#include "adapters/simulation/vtkhdf/hdf5_file.hpp"
#include "adapters/simulation/vtkhdf/packed_grid.hpp"
#include "adapters/simulation/vtkhdf/vtkhdf.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::io::vtkhdf {
namespace {
using grid::CellKind;
using grid::Grid;

const std::string root = "VTKHDF", steps_group = "VTKHDF/Steps";
constexpr std::uint64_t largest_index = 0xfffffffe;

/// One kind of cells with its own connectivity: that of grids, or one of the four of polygons.
struct Topology {
  std::string group;
  std::optional<CellKind> kind;  // default: Types has them
};

/// Where a step begins in the arrays, which hold all steps one after the other.
struct Start {
  std::uint64_t part = 0, parts = 0, point = 0;
  std::vector<std::uint64_t> cells, indices;  // per topology
};

std::vector<Topology> topologies_of(const hdf5::File& file) {
  if (!file.has(root))
    file.fail("has no group VTKHDF; export the run as VTKHDF, or give another format", Status::unsupported_input);
  const std::uint64_t version = file.first_of_attribute(root, "Version");
  if (version < 1 || version > 2)
    file.fail("VTKHDF version " + std::to_string(version) + " is not read; export it as version 2",
              Status::unsupported_input);
  const std::string type = file.text_attribute(root, "Type");
  if (type == "UnstructuredGrid") return {{root + "/", std::nullopt}};
  if (type != "PolyData")
    file.fail("holds a " + type + "; export it as UnstructuredGrid or PolyData", Status::unsupported_input);
  return {{root + "/Vertices/", CellKind::poly_vertex},
          {root + "/Lines/", CellKind::poly_line},
          {root + "/Polygons/", CellKind::polygon},
          {root + "/Strips/", CellKind::triangle_strip}};
}

/// The number of a step in Steps/`name`, which has a column per topology; 0 when the file does not have it.
std::vector<std::uint64_t> step_values(const hdf5::File& file, const std::string& name, std::uint32_t step,
                                       std::size_t columns) {
  const std::string dataset = steps_group + "/" + name;
  if (!file.has(dataset)) return std::vector<std::uint64_t>(columns, 0);
  const auto values = file.read_counts(dataset, step, 1);
  if (values.size() != columns)
    file.fail("\"" + dataset + "\" has " + std::to_string(values.size()) + " columns, not " + std::to_string(columns));
  return values;
}

std::uint64_t parts_of(const hdf5::File& file, std::uint32_t step) {
  const std::uint64_t all = file.shape(root + "/NumberOfPoints").rows;
  if (!file.has(steps_group)) return all;
  if (file.has(steps_group + "/NumberOfParts")) return step_values(file, "NumberOfParts", step, 1)[0];
  const std::uint64_t steps = file.shape(steps_group + "/Values").rows;
  if (all % steps != 0) file.fail("\"" + steps_group + "\" has no NumberOfParts; export it again");
  return all / steps;
}

Start start_of(const hdf5::File& file, std::uint32_t step, std::size_t topologies) {
  Start start;
  start.parts = parts_of(file, step);
  start.cells.assign(topologies, 0);
  start.indices.assign(topologies, 0);
  if (!file.has(steps_group)) return start;
  start.part = step_values(file, "PartOffsets", step, 1)[0];
  start.point = step_values(file, "PointOffsets", step, 1)[0];
  start.cells = step_values(file, "CellOffsets", step, topologies);
  start.indices = step_values(file, "ConnectivityIdOffsets", step, topologies);
  return start;
}

/// Offsets has one entry more than cells in each part: the number of parts before `cell`, whose cells add up to it.
/// A mesh that does not change is stored once, for the parts of all steps.
std::uint64_t parts_before(const hdf5::File& file, const Topology& topology, std::uint64_t cell, std::uint64_t part) {
  const auto counts = file.read_counts(topology.group + "NumberOfCells", 0, part);
  if (std::accumulate(counts.begin(), counts.end(), std::uint64_t{0}) == cell) return part;
  std::uint64_t parts = 0, sum = 0;
  while (sum < cell && parts < counts.size()) sum += counts[parts++];
  return parts;
}

/// The cells of one topology in successive parts of a step.
class TopologyReader {
 public:
  TopologyReader(const hdf5::File& file, const Topology& topology, const Start& start, std::size_t index)
      : file_(file), topology_(topology), is_stored_(file.has(topology.group + "NumberOfCells")) {
    if (!is_stored_) return;
    cells_ = file.read_counts(topology.group + "NumberOfCells", start.part, start.parts);
    indices_ = file.read_counts(topology.group + "NumberOfConnectivityIds", start.part, start.parts);
    cell_ = start.cells[index];
    end_ = cell_ + parts_before(file, topology, cell_, start.part);
    index_ = start.indices[index];
  }

  /// Adds the cells of the next part.
  std::uint64_t add_part(std::size_t part, Grid& into) {
    if (!is_stored_) return 0;
    const std::uint64_t cells = cells_[part];
    if (cells > 0) add_cells(cells, indices_[part], into);
    cell_ += cells;
    end_ += cells + 1;
    index_ += indices_[part];
    return cells;
  }

 private:
  void add_cells(std::uint64_t cells, std::uint64_t indices, Grid& into) const {
    const auto ends = file_.read_counts(topology_.group + "Offsets", end_, cells + 1);
    const auto list = file_.read_counts(topology_.group + "Connectivity", index_, indices);
    const auto kinds = topology_.kind ? std::vector<std::uint64_t>(cells, static_cast<std::uint64_t>(*topology_.kind))
                                      : file_.read_counts(topology_.group + "Types", cell_, cells);
    std::vector<std::uint32_t> corners;
    for (std::size_t c = 0; c < cells; ++c) {
      if (ends[c] > ends[c + 1] || ends[c + 1] > list.size())
        file_.fail("\"" + topology_.group + "Offsets\" decreases or leads beyond Connectivity; it is damaged");
      if (kinds[c] > 255) file_.fail("\"" + topology_.group + "Types\" has a type of cell that does not exist");
      corners.clear();
      for (std::uint64_t i = ends[c]; i < ends[c + 1]; ++i)
        corners.push_back(static_cast<std::uint32_t>(std::min(list[i], largest_index)));
      into.cells.add(static_cast<CellKind>(kinds[c]), corners);
    }
  }

  const hdf5::File& file_;
  const Topology& topology_;
  bool is_stored_;
  std::vector<std::uint64_t> cells_, indices_;    // of the parts
  std::uint64_t cell_ = 0, end_ = 0, index_ = 0;  // where the next part begins in Types, Offsets, Connectivity
};

/// The arrays of one part. `first`: its first row; `of_step`: that of the step, from which an array may be shifted.
void read_arrays(const hdf5::File& file, const std::string& kind, std::uint32_t step, std::uint64_t of_step,
                 std::uint64_t first, std::uint64_t rows, std::vector<grid::Array>& into) {
  for (const std::string& name : file.names_in(root + "/" + kind)) {
    const std::string dataset = root + "/" + kind + "/" + name;
    const std::string offsets = steps_group + "/" + kind + "Offsets/" + name;
    const std::uint64_t start = file.has(offsets) ? file.read_counts(offsets, step, 1)[0] : of_step;
    into.push_back({name, file.shape(dataset).columns, file.read(dataset, start + (first - of_step), rows)});
  }
}

std::vector<double> own_time(const hdf5::File& file) {
  const std::string name = root + "/FieldData/TimeValue";
  return file.has(name) && file.shape(name).rows == 1 ? file.read(name, 0, 1) : std::vector<double>();
}

/// The times of the steps; of a file without steps none, or its own.
std::vector<double> times_in(const hdf5::File& file) {
  static_cast<void>(topologies_of(file));
  if (!file.has(steps_group)) return own_time(file);
  const std::string values = steps_group + "/Values";
  std::vector<double> times = file.read(values, 0, file.shape(values).rows);
  if (times.empty()) file.fail("has no steps; export it again");
  return times;
}

Grid state_in_file(const grid::GridState& state) {
  const hdf5::File file(state.file);
  const std::vector<Topology> topologies = topologies_of(file);
  const std::uint32_t step = state.step.value_or(0);
  const Start start = start_of(file, step, topologies.size());
  const auto points = file.read_counts(root + "/NumberOfPoints", start.part, start.parts);
  if (file.shape(root + "/Points").columns != 3) file.fail("\"" + root + "/Points\" has not three columns");
  std::vector<TopologyReader> readers;
  for (std::size_t t = 0; t < topologies.size(); ++t) readers.emplace_back(file, topologies[t], start, t);
  const std::uint64_t cells_of_step = std::accumulate(start.cells.begin(), start.cells.end(), std::uint64_t{0});
  Grid whole;
  std::uint64_t point = start.point, cell = cells_of_step;
  for (std::size_t part = 0; part < start.parts; ++part) {
    Grid piece;
    const auto positions = file.read(root + "/Points", point, points[part]);
    piece.positions.assign(positions.begin(), positions.end());
    std::uint64_t cells = 0;
    for (TopologyReader& reader : readers) cells += reader.add_part(part, piece);
    read_arrays(file, "PointData", step, start.point, point, points[part], piece.point_arrays);
    read_arrays(file, "CellData", step, cells_of_step, cell, cells, piece.cell_arrays);
    const std::string name = state.name() + ", part " + std::to_string(part);
    grid::check_grid(piece, name);
    grid::add_piece(piece, name, whole);
    point += points[part];
    cell += cells;
  }
  return whole;
}

/// What the child has returned, which a damaged file may have overwritten.
template <typename Read>
auto checked(const std::filesystem::path& file, Read read) {
  try {
    return read();
  } catch (const std::out_of_range&) {
    throw Error{Status::bad_input, file.string() + ": libhdf5 fails to read it; it is damaged, export it again (HDF5)"};
  }
}
}  // namespace

std::vector<grid::GridState> list_states(const std::filesystem::path& file) {
  const auto bytes = child::run(file, [&] {
    const hdf5::File opened(file);
    const std::uint8_t has_steps = opened.has(steps_group) ? 1 : 0;
    child::Packer into;
    into.add(std::span<const double>(times_in(opened)));
    into.add(std::span(&has_steps, 1));
    return into.take();
  });
  return checked(file, [&] {
    child::Unpacker from(bytes);
    const auto times = from.next<double>();
    if (from.next<std::uint8_t>().at(0) == 0)
      return std::vector<grid::GridState>{{file, times.empty() ? std::nullopt : std::optional(times[0]), std::nullopt}};
    std::vector<grid::GridState> states;
    for (const double time : times) states.push_back({file, time, static_cast<std::uint32_t>(states.size())});
    return states;
  });
}

Grid read_state(const grid::GridState& state) {
  const auto bytes = child::run(state.file, [&] { return packed(state_in_file(state)); });
  Grid grid = checked(state.file, [&] { return unpacked(bytes); });
  grid.time = state.time;
  return grid;
}
}  // namespace lbea::io::vtkhdf
