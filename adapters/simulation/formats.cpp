// The formats of simulation files. To add one with a mesh per file:
// 1. Write mesh/NAME.cpp with is_NAME(), which recognizes the start of a file, and parse_NAME(), which returns a Grid.
// 2. Declare both below and add a row to the table. Formats are tried in its order: those with a unique mark come
// first.
// 3. Add a test to tests/simulation, files to tests/data/fuzz/mesh_files, and a line to docs/ensembles.md.
// A format with several states per file implements bake::SimulationReader instead, as d3plot/reader.cpp does.
#include "adapters/simulation/open.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"
#include "adapters/simulation/d3plot/words.hpp"
#include "adapters/simulation/grid/grid_reader.hpp"
#include "adapters/simulation/keyword/keyword.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "adapters/simulation/vtkhdf/vtkhdf.hpp"

#include <algorithm>
#include <fstream>

namespace lbea::io {
namespace grid {
IsFormat is_radioss_animation, is_ply, is_obj;
bool is_stl(const std::filesystem::path& file, std::string_view start);
ParseGrid parse_radioss_animation, parse_ply, parse_stl, parse_obj;
Grid read_radioss_time(const std::filesystem::path& file);
}  // namespace grid

namespace {
namespace fs = std::filesystem;
using Reader = std::unique_ptr<bake::SimulationReader>;

constexpr std::size_t start_bytes = 8192;
constexpr std::string_view collection_name = "ParaView collection", parallel_name = "VTK parallel",
                           xml_name = "VTK XML";

/// What a run was opened by.
enum class Given { file, single_file, folder };

struct SimulationFormat {
  std::string_view name;
  const char* text;  // for --list-formats: which files, which states
  bool (*is_format)(const fs::path& file, std::string_view start);
  Reader (*open)(const fs::path& file, Given given);
};

bool is_d3plot(const fs::path& file, std::string_view) {
  return d3plot::detect_encoding(d3plot::WordFile(file)).has_value();
}

template <grid::IsFormat* is_format>
bool by_start(const fs::path&, std::string_view start) {
  return is_format(start);
}

template <grid::ParseGrid* parse>
grid::Grid read_grid(const fs::path& file) {
  return parse(as_text(read_file(file)), file.string());
}

/// The files of the run: the numbered series of `file`, or `file` alone when it holds a whole run.
template <grid::ParseGrid* parse>
std::vector<fs::path> members_of(const fs::path& file, Given given) {
  if (given == Given::single_file) return {file};
  std::vector<fs::path> series = find_series(file);
  // Names of arrays are plain text in every encoding: most files need not be parsed for this.
  if (series.size() == 1 || as_text(read_file(file)).find(grid::displacement_array) == std::string_view::npos ||
      !grid::holds_run(read_grid<parse>(file)))
    return series;
  if (given == Given::folder)
    throw Error{Status::bad_input, file.string() + " holds a whole run (point arrays displacement_t<time>), as may " +
                                       series.back().filename().string() + " beside it; give one of these files"};
  return {file};
}

template <grid::ParseGrid* parse, grid::ReadGrid read_time = nullptr, grid::ListParts list_parts = nullptr>
Reader open_series(const fs::path& file, Given given) {
  std::vector<grid::GridState> states;
  for (const fs::path& member : members_of<parse>(file, given)) states.push_back({member});
  return std::make_unique<grid::GridReader>(
      std::move(states), [](const auto& state) { return read_grid<parse>(state.file); }, read_time, list_parts);
}

Reader open_family(const fs::path& file, Given) { return open_d3plot(file); }

Reader open_collection(const fs::path& file, Given) {
  return std::make_unique<grid::GridReader>(
      grid::read_vtk_collection(file), [](const auto& state) { return grid::read_vtk_member(state.file); }, nullptr,
      grid::list_vtk_pieces);
}

Reader open_vtkhdf(const fs::path& file, Given) {
  return std::make_unique<grid::GridReader>(vtkhdf::list_states(file), vtkhdf::read_state, nullptr);
}

constexpr std::array formats{
    SimulationFormat{"LS-DYNA d3plot", "family d3plot, d3plot01, ...: all its states", is_d3plot, open_family},
    SimulationFormat{"OpenRadioss animation", "R004A001, ...: a state per numbered file",
                     by_start<grid::is_radioss_animation>,
                     open_series<grid::parse_radioss_animation, grid::read_radioss_time>},
    SimulationFormat{"VTKHDF", ".vtkhdf, .hdf with an unstructured grid or polygons: all its steps",
                     by_start<vtkhdf::is_vtkhdf>, open_vtkhdf},
    SimulationFormat{"VTK legacy",
                     ".vtk with an unstructured grid or polygons, text or binary: a state per numbered file",
                     by_start<grid::is_vtk_legacy>, open_series<grid::parse_vtk_legacy, grid::read_vtk_legacy_time>},
    SimulationFormat{collection_name, ".pvd: a state per file it names, VTK XML or parallel",
                     by_start<grid::is_vtk_collection>, open_collection},
    SimulationFormat{parallel_name, ".pvtu, .pvtp: the pieces they name; states as VTK XML",
                     by_start<grid::is_vtk_parallel>,
                     open_series<grid::parse_vtk_parallel, grid::read_vtk_parallel_time, grid::list_vtk_pieces>},
    SimulationFormat{xml_name, ".vtu, .vtp: a state per numbered file, or per point array displacement_t<time>",
                     by_start<grid::is_vtk_xml>, open_series<grid::parse_vtk_xml, grid::read_vtk_xml_time>},
    SimulationFormat{
        "LS-DYNA keyword", "*NODE, *ELEMENT_SHELL, _SOLID, _TSHELL, *INCLUDE: one state, or one per numbered file",
        by_start<keyword::is_keyword>, open_series<keyword::parse_keyword, nullptr, keyword::list_keyword_includes>},
    SimulationFormat{"PLY", "vertices and faces: a state per numbered file", by_start<grid::is_ply>,
                     open_series<grid::parse_ply>},
    SimulationFormat{"STL", "triangles, text or binary, joined where coordinates are equal: a state per numbered file",
                     grid::is_stl, open_series<grid::parse_stl>},
    SimulationFormat{"OBJ", "v and f lines: a state per numbered file", by_start<grid::is_obj>,
                     open_series<grid::parse_obj>}};

std::string start_of(const fs::path& file) {
  std::string start(start_bytes, '\0');
  std::error_code error;
  if (!fs::is_regular_file(file, error)) return {};  // opening a fifo would wait for its writer
  std::ifstream in(file, std::ios::binary);
  in.read(start.data(), static_cast<std::streamsize>(start.size()));
  start.resize(static_cast<std::size_t>(in.gcount()));
  return start;
}

const SimulationFormat* format_of(const fs::path& file) {
  const std::string start = start_of(file);
  const auto found =
      std::find_if(formats.begin(), formats.end(), [&](const auto& format) { return format.is_format(file, start); });
  return found == formats.end() ? nullptr : &*found;
}

/// The only run in a folder; collections and parallel files represent the files they name.
fs::path only_run(const fs::path& folder) {
  std::vector<fs::path> runs, named;
  bool has_parallel = false;
  for (const fs::path& file : first_files(folder)) {
    const SimulationFormat* format = format_of(file);
    if (format != nullptr && format->name == collection_name) return file;
    if (format == nullptr) continue;
    has_parallel = has_parallel || format->name == parallel_name;
    (format->name == xml_name ? named : runs).push_back(file);
  }
  if (!has_parallel) runs.insert(runs.end(), named.begin(), named.end());
  if (runs.empty())
    throw Error{Status::file_not_found, folder.string() + " holds no file named d3plot and no other run (" +
                                            simulation_format_names() + "); give the first file of the run itself"};
  if (runs.size() > 1)
    throw Error{Status::bad_input, folder.string() + " holds more than one run, for instance " +
                                       runs[0].filename().string() + " and " + runs[1].filename().string() +
                                       "; give the first file of one"};
  return runs.front();
}

fs::path first_file(const fs::path& path) {
  std::error_code error;
  if (!fs::is_directory(path, error)) return path;
  const fs::path d3plot = path / "d3plot";
  return fs::exists(d3plot, error) ? d3plot : only_run(path);
}
}  // namespace

Reader open_simulation(const fs::path& path, bool is_alone) {
  const fs::path file = first_file(path);
  const Given given = file != path ? Given::folder : is_alone ? Given::single_file : Given::file;
  if (const SimulationFormat* format = format_of(file)) return format->open(file, given);
  static_cast<void>(text::checked_encoding(start_of(file), file.string()));
  throw Error{Status::unsupported_input, file.string() + ", byte 0: the file has none of the supported formats (" +
                                             simulation_format_names() +
                                             "), or it is compressed; give the first file of such a run"};
}

std::string simulation_format_names() {
  std::string names;
  for (const SimulationFormat& format : formats) names += (names.empty() ? "" : ", ") + std::string(format.name);
  return names;
}

std::string list_simulation_formats() {
  std::string list = "Simulations, recognized by content; give a run's first file or a folder with one run:\n";
  for (const SimulationFormat& format : formats) {
    std::string name(format.name);
    name.resize(std::max<std::size_t>(name.size() + 1, 22), ' ');
    list += "  " + name + format.text + "\n";
  }
  return list;
}
}  // namespace lbea::io
