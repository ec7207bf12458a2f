// Thick shells of d3plot databases: their faces, ids, fields and erosion beside solids and shells.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

#include "adapters/simulation/open.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {
D3plotPoint point(double plastic_strain, double shear) {
  D3plotPoint point;
  point.plastic_strain = plastic_strain;
  point.stress[3] = shear;  // von Mises: sqrt(3) |shear|
  return point;
}

/// A tower of a solid, a thick shell on it, and a shell on top; in the second state the thick shell is eroded.
D3plot tower() {
  D3plot d;
  for (int z = 0; z < 3; ++z)
    for (const auto& [x, y] : {std::pair(0, 0), {1, 0}, {1, 1}, {0, 1}})
      d.nodes.push_back({static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)});
  d.solids = {{0, 1, 2, 3, 4, 5, 6, 7}};
  d.thick_shell_nodes = {{4, 5, 6, 7, 8, 9, 10, 11}};
  d.shells = {{8, 9, 10, 11}};
  d.solid_parts = d.shell_parts = {1};
  d.solid_ids = {11};
  d.thick_shell_ids = {22};
  d.shell_ids = {33};
  d.part_ids = {5};
  d.layers = 2;
  d.has_stress = true;
  for (const double time : {0.0, 1.0}) {
    D3plotState state;
    state.time = time;
    state.positions = d.nodes;
    state.positions[8][2] += time;
    state.solids = {{point(0.5, 1)}};
    state.thick_shells = {{point(0.1, -7), point(0.25, 3)}};
    state.shells = {{{point(0.75, 2), point(0.7, 2)}, 0, 0, {}}};
    state.solid_flags = state.shell_flags = {1};
    state.thick_shell_flags = {time == 0 ? 1.0 : 0.0};
    d.states.push_back(state);
  }
  return d;
}
}  // namespace

TEST_CASE("thick shells are part of the surface, with the largest values of their layers") {
  for (const std::size_t word_bytes : {4u, 8u}) {
    CAPTURE(word_bytes);
    D3plot database = tower();
    database.word_bytes = word_bytes;
    const TemporaryFolder folder;
    const auto run = open_simulation(write_d3plot(database, folder.path()));
    const SimulationMesh& mesh = run->mesh();
    // one shell, five faces of each brick, and the face between them twice
    REQUIRE(mesh.elements.size() == 1 + 5 + 5 + 2);
    CHECK(mesh.touching == 2);
    CHECK(std::ranges::count(mesh.element_ids, 11u) == 6);
    CHECK(std::ranges::count(mesh.element_ids, 22u) == 6);
    CHECK(std::ranges::count(mesh.element_parts, 5u) == 13);
    REQUIRE(run->fields().size() == 2);
    SimulationState state;
    run->read(0, state);
    for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
      const std::uint32_t id = mesh.element_ids[e];
      CAPTURE(id);
      CHECK(state.fields[0][e] == (id == 11 ? 0.5f : id == 22 ? 0.25f : 0.75f));
      CHECK(state.fields[1][e] == doctest::Approx(std::sqrt(3.0) * (id == 11 ? 1 : id == 22 ? 7 : 2)));
      CHECK(state.alive[e] == 1);
    }
    run->read(1, state);
    CHECK(state.positions[3 * 8 + 2] == 3);
    const auto exposed = exposed_elements(mesh, state.alive);
    for (std::size_t e = 0; e < exposed.size(); ++e) CHECK(exposed[e] == (mesh.element_ids[e] == 22 ? 0 : 1));
  }
}

TEST_CASE("a database of thick shells alone has a surface; damaged ones are refused") {
  D3plot database = tower();
  database.solids.clear();
  database.shells.clear();
  for (D3plotState& state : database.states) {
    state.solids.clear();
    state.shells.clear();
    state.solid_flags.clear();
    state.shell_flags.clear();
  }
  const TemporaryFolder folder;
  const auto run = open_simulation(write_d3plot(database, folder.path()));
  CHECK(run->mesh().elements.size() == 6);
  CHECK(run->mesh().nodes() == 8);
  database.thick_shell_nodes[0][3] = 77;
  check_error(error_of([&] { open_simulation(write_d3plot(database, folder.path())); }), Status::bad_input,
              {"thick shells refer to node 78"});
}
