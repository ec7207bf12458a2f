#include "tests/simulation/d3plot/d3plot_expectations.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <string>

namespace lbea::test {

using namespace lbea::bake;

namespace {

double equivalent(const std::array<double, 6>& t, double factor) {
  const double differences =
      (t[0] - t[1]) * (t[0] - t[1]) + (t[1] - t[2]) * (t[1] - t[2]) + (t[2] - t[0]) * (t[2] - t[0]);
  // s:s of the deviator, from the differences of the diagonal
  return std::sqrt(factor * (differences / 3 + 2 * (t[3] * t[3] + t[4] * t[4] + t[5] * t[5])));
}

struct Expected {
  std::map<std::string, double> fields;
  int alive = 1;
};

void add_points(const std::vector<D3plotPoint>& points, Expected& into) {
  for (const D3plotPoint& point : points) {
    double& plastic = into.fields["plastic_strain"];
    plastic = std::max(plastic, point.plastic_strain);
    double& mises = into.fields["von_mises"];
    mises = std::max(mises, equivalent(point.stress, 1.5));
  }
}

bool is_rigid(const D3plot& d, std::size_t shell) {
  return (d.ndim == 5 || d.ndim == 7) && d.file_type != 5 &&
         d.material_types[static_cast<std::size_t>(d.shell_parts[shell] - 1)] == 20;
}

Expected expected_shell(const D3plot& d, std::size_t state, std::size_t shell) {
  Expected expected;
  const auto& result = d.states[state].shells[shell];
  if (d.deletion == D3plot::Deletion::elements) expected.alive = d.states[state].shell_flags[shell] != 0;
  if (d.deletion == D3plot::Deletion::nodes) expected.alive = !(state > 0 && shell == 0);
  if (is_rigid(d, shell)) return expected;
  add_points(result.layers, expected);
  expected.fields["thickness"] = result.thickness;
  expected.fields["internal_energy"] = result.internal_energy;
  expected.fields["effective_strain"] =
      std::max(equivalent(result.strain[0], 2.0 / 3.0), equivalent(result.strain[1], 2.0 / 3.0));
  return expected;
}

Expected expected_solid(const D3plot& d, std::size_t state, std::size_t solid) {
  Expected expected;
  const auto& points = d.states[state].solids[solid];
  if (d.deletion == D3plot::Deletion::elements) expected.alive = d.states[state].solid_flags[solid] != 0;
  add_points(points, expected);
  if (d.has_strain && d.history >= 6)
    for (const D3plotPoint& point : points) {
      std::array<double, 6> strain{};
      std::copy_n(point.history.end() - 6, 6, strain.begin());
      expected.fields["effective_strain"] =
          std::max(expected.fields["effective_strain"], equivalent(strain, 2.0 / 3.0));
    }
  return expected;
}

/// The solver's id of thing `index`: as numbered, or counted from 1.
std::uint32_t id_of(const std::vector<int>& ids, bool is_numbered, std::size_t index) {
  return static_cast<std::uint32_t>(is_numbered ? ids[index] : static_cast<int>(index) + 1);
}

std::size_t index_of(const std::vector<int>& ids, bool has_numbering, std::uint32_t id) {
  if (!has_numbering) return id - 1;
  return static_cast<std::size_t>(std::find(ids.begin(), ids.end(), static_cast<int>(id)) - ids.begin());
}

}  // namespace

void check_mesh(const D3plot& d, const lbea::bake::SimulationMesh& mesh) {
  const std::size_t solid_faces = d.solids.empty() ? 0 : 11;
  const bool can_erode = d.deletion == D3plot::Deletion::elements;
  REQUIRE(mesh.touching == (can_erode && !d.solids.empty() ? 4 : 0));  // two faces, each of two solids
  REQUIRE(mesh.elements.size() - mesh.touching == d.shells.size() + solid_faces);
  REQUIRE(mesh.element_ids.size() == mesh.elements.size());
  REQUIRE(mesh.element_parts.size() == mesh.elements.size());
  REQUIRE(mesh.positions.size() == 3 * mesh.nodes());
  for (std::size_t s = 0; s < d.shells.size(); ++s) {
    const auto part = static_cast<std::size_t>(d.shell_parts[s] - 1);
    CHECK(mesh.element_ids[s] == id_of(d.shell_ids, d.has_numbering, s));
    CHECK(mesh.element_parts[s] == id_of(d.part_ids, d.has_numbering && d.has_part_ids, part));
    for (std::size_t c = 0; c < 4; ++c) {
      const std::uint32_t node = d.shells[s][c];
      const std::uint32_t read = mesh.elements[s][c];
      CHECK(mesh.node_ids[read] == id_of(d.node_ids, d.has_numbering, node));
      for (std::size_t axis = 0; axis < 3; ++axis)
        CHECK(mesh.positions[3 * read + axis] == static_cast<float>(d.nodes[node][axis]));
    }
  }
}

void check_state(const D3plot& d, lbea::bake::SimulationReader& run, std::uint32_t s,
                 lbea::bake::SimulationState& state) {
  CAPTURE(s);
  run.read(s, state);
  const auto& mesh = run.mesh();
  const double time = d.states[s].time;
  CHECK(state.time_s == (d.word_bytes == 4 ? static_cast<double>(static_cast<float>(time)) : time));
  CHECK(run.time_s(s) == state.time_s);
  for (std::size_t n = 0; n < mesh.nodes(); ++n) {
    const std::size_t node = index_of(d.node_ids, d.has_numbering, mesh.node_ids[n]);
    for (std::size_t axis = 0; axis < 3; ++axis)
      CHECK(state.positions[3 * n + axis] == static_cast<float>(d.states[s].positions[node][axis]));
  }
  REQUIRE(state.alive.size() == mesh.elements.size());
  REQUIRE(state.fields.size() == run.fields().size());
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    CAPTURE(e);
    const Expected expected = e < d.shells.size()
                                  ? expected_shell(d, s, e)
                                  : expected_solid(d, s, index_of(d.solid_ids, d.has_numbering, mesh.element_ids[e]));
    CHECK(static_cast<int>(state.alive[e]) == expected.alive);
    for (std::size_t f = 0; f < state.fields.size(); ++f) {
      const auto found = expected.fields.find(run.fields()[f].name);
      const double value = found == expected.fields.end() ? 0 : found->second;
      CHECK(state.fields[f][e] == doctest::Approx(value).epsilon(1e-6));  // a few roundings of single precision
    }
  }
}

}  // namespace lbea::test
