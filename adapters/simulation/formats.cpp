#include "adapters/simulation/formats.hpp"

#include <array>

#include "adapters/simulation/d3plot/d3plot_encoding.hpp"
#include "adapters/simulation/mesh/keyword_mesh.hpp"
#include "adapters/simulation/mesh/obj_mesh.hpp"
#include "adapters/simulation/mesh/ply_mesh.hpp"
#include "adapters/simulation/mesh/stl_mesh.hpp"
#include "adapters/simulation/open.hpp"
#include "adapters/simulation/series.hpp"
#include "adapters/simulation/vtk/grid_reader.hpp"
#include "adapters/simulation/vtk/vtk_collection.hpp"
#include "adapters/simulation/vtk/vtk_legacy.hpp"
#include "adapters/simulation/vtk/vtk_xml.hpp"

namespace lbea::io {
namespace {

namespace fs = std::filesystem;

bool is_d3plot(const fs::path& file, std::string_view) {
  return d3plot::detect_encoding(d3plot::WordFile(file)).has_value();
}

template <bool (*is_it)(std::string_view) noexcept>
bool by_start(const fs::path&, std::string_view start) {
  return is_it(start);
}

template <grid::ReadGrid read, grid::ReadGrid read_time = nullptr>
std::unique_ptr<bake::SimulationReader> open_series(const fs::path& file) {
  std::vector<grid::GridState> states;
  for (const fs::path& member : find_series(file)) states.push_back({member, std::nullopt});
  return std::make_unique<grid::GridReader>(std::move(states), read, read_time);
}

std::unique_ptr<bake::SimulationReader> open_collection(const fs::path& file) {
  return std::make_unique<grid::GridReader>(grid::read_vtk_collection(file), grid::read_vtk_xml, nullptr);
}

constexpr std::array formats{
    SimulationFormat{"LS-DYNA d3plot", "family d3plot, d3plot01, ...: all its states", is_d3plot, open_d3plot},
    SimulationFormat{"VTK legacy",
                     ".vtk with an unstructured grid or polygons, text or binary: a state per numbered file",
                     by_start<grid::is_vtk_legacy>, open_series<grid::read_vtk_legacy, grid::read_vtk_legacy_time>},
    SimulationFormat{"ParaView collection", ".pvd: a state per VTU or VTP file it names",
                     by_start<grid::is_vtk_collection>, open_collection},
    SimulationFormat{"VTK XML", ".vtu, .vtp: a state per numbered file, or per point array displacement_t<time>",
                     by_start<grid::is_vtk_xml>, open_series<grid::read_vtk_xml, grid::read_vtk_xml_time>},
    SimulationFormat{"LS-DYNA keyword", "*NODE, *ELEMENT_SHELL, *ELEMENT_SOLID: one state, or one per numbered file",
                     by_start<grid::is_keyword>, open_series<grid::read_keyword>},
    SimulationFormat{"PLY", "vertices and faces: a state per numbered file", by_start<grid::is_ply>,
                     open_series<grid::read_ply>},
    SimulationFormat{"STL", "triangles, text or binary, joined where coordinates are equal: a state per numbered file",
                     grid::is_stl, open_series<grid::read_stl>},
    SimulationFormat{"OBJ", "v and f lines: a state per numbered file", by_start<grid::is_obj>,
                     open_series<grid::read_obj>}};

}  // namespace

std::span<const SimulationFormat> simulation_formats() noexcept { return formats; }

}  // namespace lbea::io
