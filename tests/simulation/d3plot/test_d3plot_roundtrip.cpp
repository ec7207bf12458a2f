// What the test writer writes, the reader reads: over word sizes, families, kinds of results and of things to skip.
#include <doctest/doctest.h>

#include "adapters/simulation/open.hpp"
#include "tests/simulation/d3plot/d3plot_expectations.hpp"
#include "tests/support/test_data.hpp"

using lbea::test::D3plot;
using lbea::test::sample_d3plot;

namespace {

std::vector<std::string> names(const lbea::bake::SimulationReader& run) {
  std::vector<std::string> all;
  for (const auto& field : run.fields()) all.push_back(field.name);
  return all;
}

std::vector<std::string> round_trip(const D3plot& d) {
  const lbea::test::TemporaryFolder folder;
  const auto run = lbea::io::open_simulation(write_d3plot(d, folder.path()));
  check_mesh(d, run->mesh());
  REQUIRE(run->states() == d.states.size());
  lbea::bake::SimulationState state;
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

TEST_CASE("rigid shells alone have positions and ids, and no results") {
  D3plot d = sample_d3plot(2);
  d.ndim = 5;
  d.material_types.assign(d.material_types.size(), 20);
  d.solids.clear();
  d.solid_parts.clear();
  fill_states(d, 2);
  CHECK(round_trip(d).empty());
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

TEST_CASE("continuations are read in numeric order, and strangers ignored") {
  const lbea::test::TemporaryFolder folder;
  D3plot d = sample_d3plot(101);
  d.states_per_file = 1;
  const auto first = write_d3plot(d, folder.path(), "crash.d3plot");
  for (const char* name : {"crash.d3plot1", "crash.d3plot007", "crash.d3plot01.bak", "other.d3plot01"})
    write_d3plot(D3plot{}, folder.path(), name);
  const auto run = lbea::io::open_simulation(first);
  REQUIRE(run->states() == 101);
  const auto files = run->files();
  REQUIRE(files.size() == 102);
  CHECK(files[9].filename() == "crash.d3plot09");
  CHECK(files[10].filename() == "crash.d3plot10");
  CHECK(files[101].filename() == "crash.d3plot101");
  for (std::uint32_t s = 1; s < 101; ++s) CHECK(run->time_s(s) > run->time_s(s - 1));
}

TEST_CASE("states without an end marker, and padding instead of one") {
  for (const std::size_t states_per_file : {0u, 1u}) {
    D3plot d = sample_d3plot(3);
    d.states_per_file = states_per_file;
    d.has_end_markers = false;
    round_trip(d);
  }
}
