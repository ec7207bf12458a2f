// A run as the solver's converter writes it in VTK, written again as the animation files that it was converted from.
#include <doctest/doctest.h>

#include <algorithm>

#include "adapters/files/atomic_file.hpp"
#include "adapters/simulation/open.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "tests/support/files.hpp"
#include "tests/support/radioss_writer.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {
namespace fs = std::filesystem;

const std::vector<double>& values(const std::vector<grid::Array>& arrays, const std::string& name) {
  const grid::Array* found = grid::find_array(arrays, name);
  REQUIRE(found != nullptr);
  return found->values;
}

RadiossAnimation animation_of(const grid::Grid& converted) {
  RadiossAnimation a;
  a.time = static_cast<float>(converted.time.value());
  a.positions = converted.positions;
  for (const double id : values(converted.point_arrays, "NODE_ID"))
    a.node_ids.push_back(static_cast<std::uint32_t>(id));
  const auto& ids = values(converted.cell_arrays, "ELEMENT_ID");
  const auto& parts = values(converted.cell_arrays, "PART_ID");
  const auto& alive = values(converted.cell_arrays, "EROSION_STATUS");
  for (std::size_t c = 0; c < converted.cells.size(); ++c) {
    const auto corners = converted.cells[c];
    REQUIRE(corners.size() == 4);  // of triangles, too
    a.shells.nodes.insert(a.shells.nodes.end(), corners.begin(), corners.end());
    a.shells.ids.push_back(static_cast<std::uint32_t>(ids[c]));
    a.shells.alive += alive[c] != 0 ? '\1' : '\0';
    if (c == 0 || parts[c] != parts[c - 1])
      a.shells.parts.emplace_back(0, std::to_string(static_cast<int>(parts[c])) + ": part");
    a.shells.parts.back().first = static_cast<std::uint32_t>(c) + 1;
  }
  for (const grid::Array& array : converted.cell_arrays) {
    if (!array.name.starts_with("2DELEM_")) continue;
    std::string name = array.name.substr(7);
    std::ranges::replace(name, '_', ' ');
    a.shells.scalars.emplace_back(name, std::vector<float>(array.values.begin(), array.values.end()));
  }
  return a;
}
}  // namespace

TEST_CASE("animation files are the run that the converter makes of them") {
  const fs::path run = reference_data() / "vtk" / "run_004";
  const TemporaryFolder folder;
  for (const char* name : {"R004A001", "R004A007", "R004A061"}) {
    const fs::path converted = run / (std::string(name) + ".vtk");
    const auto bytes = read_file(converted);
    const grid::Grid grid = grid::parse_vtk_legacy(as_text(bytes), converted.string());
    put(folder / name, RadiossWriter(animation_of(grid)).bytes());
    fs::create_directories(folder / "vtk");
    fs::copy_file(converted, folder / "vtk" / converted.filename());
  }
  const auto vtk = open_simulation(folder / "vtk"), animation = open_simulation(folder / "R004A001");
  CHECK(animation->mesh().node_ids == vtk->mesh().node_ids);
  CHECK(animation->mesh().elements == vtk->mesh().elements);
  CHECK(animation->mesh().element_ids == vtk->mesh().element_ids);
  CHECK(animation->mesh().element_parts == vtk->mesh().element_parts);
  REQUIRE(animation->states() == 3);
  REQUIRE(animation->fields().size() == vtk->fields().size());
  SimulationState a, b;
  for (std::uint32_t s = 0; s < 3; ++s) {
    animation->read(s, a);
    vtk->read(s, b);
    CHECK(a.time_s == doctest::Approx(b.time_s).epsilon(1e-6));  // of a float
    CHECK(a.positions == b.positions);
    CHECK(a.alive == b.alive);
    for (std::size_t f = 0; f < a.fields.size(); ++f) {
      CHECK(animation->fields()[f].name == vtk->fields()[f].name);
      CHECK(a.fields[f] == b.fields[f]);
    }
  }
}
