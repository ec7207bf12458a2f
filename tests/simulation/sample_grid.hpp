// The grid that tests/data/simulation/write_samples.py writes, in every format.
#pragma once

#include <doctest/doctest.h>

#include "adapters/simulation/open.hpp"

namespace lbea::test {
/// The file's name must not end in a digit, or it is a series with those beside it.
inline void check_sample_grid(const std::filesystem::path& file) {
  const auto run = io::open_simulation(file);
  const bake::SimulationMesh& mesh = run->mesh();
  REQUIRE(mesh.nodes() == 12);
  REQUIRE(mesh.elements.size() == 6);
  for (std::uint32_t node = 0; node < 12; ++node) {  // by id, which falls from 100 on in the file
    const std::uint32_t point = 11 - node;
    CHECK(mesh.node_ids[node] == 100 - point);
    CHECK(mesh.positions[3 * node] == static_cast<float>(point % 4));
    CHECK(mesh.positions[3 * node + 1] == static_cast<float>(point / 4));
    CHECK(mesh.positions[3 * node + 2] == doctest::Approx(0.1 * point));
  }
  REQUIRE(run->states() == 1);
  bake::SimulationState state;
  run->read(0, state);
  CHECK(state.time_s == 2.5);
  REQUIRE(run->fields().size() == 1);
  CHECK(run->fields()[0].name == "plastic_strain");
  for (std::uint32_t e = 0; e < 6; ++e) {
    const std::uint32_t first = e / 3 * 4 + e % 3;  // point of the first corner
    CHECK(mesh.element_ids[e] == 7 + e);
    CHECK(mesh.element_parts[e] == 1 + e / 3);
    CHECK(mesh.elements[e][0] == 11 - first);
    CHECK((mesh.elements[e][2] == mesh.elements[e][3]) == (e % 3 == 2));
    CHECK(state.fields[0][e] == 0.125f * static_cast<float>(e));
    CHECK(state.alive[e] == 1);
  }
}
}  // namespace lbea::test
