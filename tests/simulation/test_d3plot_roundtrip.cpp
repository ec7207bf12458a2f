// What the test writer writes, the reader reads: over word sizes, families, kinds of results and of things to skip.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "adapters/simulation/open.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/test_data.hpp"

using lbea::test::D3plot;
using lbea::test::D3plotPoint;
using lbea::test::sample_d3plot;

namespace {

double equivalent(const std::array<double, 6>& t, double factor) {
  const double differences = (t[0] - t[1]) * (t[0] - t[1]) + (t[1] - t[2]) * (t[1] - t[2]) +
                             (t[2] - t[0]) * (t[2] - t[0]);
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
      expected.fields["effective_strain"] = std::max(expected.fields["effective_strain"], equivalent(strain, 2.0 / 3.0));
    }
  return expected;
}

/// The solver's id of thing `index`: as numbered, or counted from 1.
std::uint32_t id_of(const std::vector<int>& ids, bool is_numbered, std::size_t index) {
  return static_cast<std::uint32_t>(is_numbered ? ids[index] : static_cast<int>(index) + 1);
}

void check_mesh(const D3plot& d, const lbea::SimulationMesh& mesh) {
  const std::size_t solid_faces = d.solids.empty() ? 0 : 11;
  REQUIRE(mesh.elements.size() == d.shells.size() + solid_faces);
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

std::size_t index_of(const std::vector<int>& ids, bool has_numbering, std::uint32_t id) {
  if (!has_numbering) return id - 1;
  return static_cast<std::size_t>(std::find(ids.begin(), ids.end(), static_cast<int>(id)) - ids.begin());
}

void check_state(const D3plot& d, lbea::SimulationReader& run, std::uint32_t s, lbea::SimulationState& state) {
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
    const Expected expected =
        e < d.shells.size() ? expected_shell(d, s, e)
                            : expected_solid(d, s, index_of(d.solid_ids, d.has_numbering, mesh.element_ids[e]));
    CHECK(static_cast<int>(state.alive[e]) == expected.alive);
    for (std::size_t f = 0; f < state.fields.size(); ++f) {
      const auto found = expected.fields.find(run.fields()[f].name);
      const double value = found == expected.fields.end() ? 0 : found->second;
      CHECK(state.fields[f][e] == doctest::Approx(value).epsilon(1e-6));  // a few roundings of single precision
    }
  }
}

std::vector<std::string> names(const lbea::SimulationReader& run) {
  std::vector<std::string> all;
  for (const auto& field : run.fields()) all.push_back(field.name);
  return all;
}

std::vector<std::string> round_trip(const D3plot& d) {
  const lbea::test::TemporaryFolder folder;
  const auto run = lbea::open_simulation(write_d3plot(d, folder.path()));
  check_mesh(d, run->mesh());
  REQUIRE(run->states() == d.states.size());
  lbea::SimulationState state;
  for (std::uint32_t s = run->states(); s-- > 0;) check_state(d, *run, s, state);  // any order
  return names(*run);
}

}  // namespace

TEST_CASE("word sizes, numbers of states and of states per file") {
  for (const std::size_t word_bytes : {4u, 8u})
    for (const std::size_t states : {0u, 1u, 2u, 7u})
      for (const std::size_t states_per_file : {0u, 1u, 3u, 7u})
        for (const bool has_titles : {true, false}) {
          CAPTURE(word_bytes);
          CAPTURE(states);
          CAPTURE(states_per_file);
          D3plot d = sample_d3plot(states);
          d.word_bytes = word_bytes;
          d.states_per_file = states_per_file;
          d.has_titles = has_titles;
          CHECK(round_trip(d) == std::vector<std::string>{"plastic_strain"});
        }
}

TEST_CASE("layers, integration points, history and the other results") {
  for (const std::size_t layers : {1u, 2u, 5u})
    for (const std::size_t points : {1u, 8u})
      for (const std::size_t history : {0u, 1u, 6u})
        for (const bool has_extra : {false, true}) {
          CAPTURE(layers);
          CAPTURE(points);
          CAPTURE(history);
          CAPTURE(has_extra);
          D3plot d = sample_d3plot(2);
          d.layers = layers;
          d.solid_points = points;
          d.history = history;
          d.has_stress = d.has_plastic_strain = true;
          d.has_forces = d.has_extra = d.has_strain = has_extra;
          fill_states(d, 2);
          const auto found = round_trip(d);
          CHECK(found.size() == (has_extra ? 5u : 2u));
        }
}

TEST_CASE("a database without results has positions only") {
  D3plot d = sample_d3plot(2);
  d.has_plastic_strain = false;
  d.layers = 0;
  fill_states(d, 2);
  CHECK(round_trip(d).empty());
}

TEST_CASE("strain announced by IDTDT, and not") {
  D3plot d = sample_d3plot(2);
  d.has_extra = true;
  d.idtdt = 10'000;
  d.has_strain = true;
  CHECK(round_trip(d) ==
        std::vector<std::string>{"plastic_strain", "thickness", "internal_energy", "effective_strain"});
  d.has_strain = false;
  d.idtdt = 101;  // says that there is none, and that there is a temperature rate
  CHECK(round_trip(d) == std::vector<std::string>{"plastic_strain", "thickness", "internal_energy"});
}

TEST_CASE("deletion per node, per element, not at all") {
  for (const auto deletion : {D3plot::Deletion::none, D3plot::Deletion::nodes, D3plot::Deletion::elements}) {
    D3plot d = sample_d3plot(3);
    d.deletion = deletion;
    d.beams = 2;
    d.thick_shells = 1;
    round_trip(d);
  }
}

TEST_CASE("numbering: none, without part ids, with them") {
  for (const bool has_numbering : {false, true})
    for (const bool has_part_ids : {false, true}) {
      D3plot d = sample_d3plot(1);
      d.has_numbering = has_numbering;
      d.has_part_ids = has_part_ids;
      round_trip(d);
    }
}

TEST_CASE("what is stepped over: temperatures, velocities, beams, thick shells, roads, longer headers") {
  for (const int it : {0, 1, 2, 3, 10, 13})
    for (const int ndim : {3, 4, 5, 7})
      for (const std::size_t extra_words : {0u, 16u, 64u}) {
        CAPTURE(it);
        CAPTURE(ndim);
        CAPTURE(extra_words);
        D3plot d = sample_d3plot(3);
        d.it = it;
        d.ndim = ndim;
        d.extra_words = extra_words;
        d.solid_thermal = extra_words > 0 ? 2 : 0;
        d.iv = d.ia = 1;
        d.idtdt = 11;
        d.beams = 3;
        d.thick_shells = 2;
        d.eight_node_shells = 1;
        round_trip(d);
      }
}

TEST_CASE("a d3part file stores the results of rigid shells, a d3plot file does not") {
  D3plot d = sample_d3plot(2);
  d.ndim = 5;
  round_trip(d);
  d.file_type = 5;
  round_trip(d);
}

TEST_CASE("shells alone and solids alone") {
  D3plot shells = sample_d3plot(2);
  shells.solids.clear();
  shells.solid_parts.clear();
  fill_states(shells, 2);
  round_trip(shells);
  D3plot solids = sample_d3plot(2);
  solids.shells.clear();
  solids.shell_parts.clear();
  fill_states(solids, 2);
  round_trip(solids);
}

TEST_CASE("continuations are read in numeric order, gaps allowed, and strangers ignored") {
  const lbea::test::TemporaryFolder folder;
  D3plot d = sample_d3plot(4);
  d.states_per_file = 1;
  d.file_numbers = {2, 10, 99, 100};
  const auto first = write_d3plot(d, folder.path(), "crash.d3plot");
  for (const char* name : {"crash.d3plot1", "crash.d3plot007", "crash.d3plot01.bak", "other.d3plot01"})
    write_d3plot(D3plot{}, folder.path(), name);
  const auto run = lbea::open_simulation(first);
  REQUIRE(run->states() == 4);
  std::vector<std::string> files;
  for (const auto& file : run->files()) files.push_back(file.filename().string());
  CHECK(files == std::vector<std::string>{"crash.d3plot", "crash.d3plot02", "crash.d3plot10", "crash.d3plot99",
                                          "crash.d3plot100"});
  for (std::uint32_t s = 1; s < 4; ++s) CHECK(run->time_s(s) > run->time_s(s - 1));
}

TEST_CASE("states without an end marker, and padding instead of one") {
  for (const std::size_t states_per_file : {0u, 1u}) {
    D3plot d = sample_d3plot(3);
    d.states_per_file = states_per_file;
    d.has_end_markers = false;
    round_trip(d);
  }
}
