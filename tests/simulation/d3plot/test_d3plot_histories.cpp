// The global values of states: each history has the number that the writer gave it, and what is not certain is left
// out.
#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <limits>

#include <lbea/lbea.hpp>

#include "adapters/simulation/open.hpp"
#include "tests/support/d3plot_writer.hpp"
#include "tests/support/test_data.hpp"

using lbea::HistoryOwner;
using lbea::test::D3plot;
using lbea::test::sample_d3plot;

namespace {

constexpr std::array<const char*, 6> of_run{"kinetic_energy", "internal_energy", "total_energy",
                                            "velocity_x",     "velocity_y",      "velocity_z"};
constexpr std::array<const char*, 7> of_part{"part_internal_energy", "part_kinetic_energy", "part_velocity_x",
                                             "part_velocity_y",      "part_velocity_z",     "part_mass",
                                             "part_hourglass_energy"};

/// Of a history, by its place among the names above; exact in single precision.
double number(std::size_t state, std::size_t history, std::size_t owner) {
  return 4096.0 * static_cast<double>(state) + 64.0 * static_cast<double>(history) + 0.5 * static_cast<double>(owner);
}

/// As the LS-DYNA database manual lists them. wall_words: 4 with the walls' positions, else 1.
std::vector<double> globals(std::size_t state, std::size_t parts, std::size_t walls, std::size_t wall_words) {
  std::vector<double> words;
  for (std::size_t h = 0; h < of_run.size(); ++h) words.push_back(number(state, h, 0));
  const auto add = [&](std::size_t history, std::size_t part) { words.push_back(number(state, 10 + history, part)); };
  for (const std::size_t energy : {0u, 1u})
    for (std::size_t part = 0; part < parts; ++part) add(energy, part);
  for (std::size_t part = 0; part < parts; ++part)
    for (const std::size_t axis : {2u, 3u, 4u}) add(axis, part);
  for (const std::size_t mass_or_hourglass : {5u, 6u})
    for (std::size_t part = 0; part < parts; ++part) add(mass_or_hourglass, part);
  for (std::size_t wall = 0; wall < walls; ++wall) words.push_back(number(state, 20, wall));
  for (std::size_t i = 0; i < walls * (wall_words - 1); ++i) words.push_back(-1);
  return words;
}

/// sample_d3plot() has parts 100, 200, 300, 400.
D3plot with_globals(std::size_t states, std::size_t walls = 0, std::size_t wall_words = 4) {
  D3plot d = sample_d3plot(states);
  for (std::size_t s = 0; s < states; ++s) d.states[s].globals = globals(s, d.parts, walls, wall_words);
  d.globals = d.states.front().globals.size();
  return d;
}

/// With other words for the globals than the writer's parts need.
D3plot with_words(std::size_t words) {
  D3plot d = with_globals(1);
  d.states.front().globals.resize(words, 1);
  d.globals = words;
  return d;
}

std::unique_ptr<lbea::bake::SimulationReader> opened(const D3plot& d, const lbea::test::TemporaryFolder& folder) {
  return lbea::io::open_simulation(write_d3plot(d, folder.path()));
}

std::vector<std::string> names(const D3plot& d) {
  const lbea::test::TemporaryFolder folder;
  std::vector<std::string> all;
  for (const auto& history : opened(d, folder)->histories()) all.push_back(history.name);
  return all;
}

std::size_t walls(const D3plot& d) {
  const lbea::test::TemporaryFolder folder;
  const auto histories = opened(d, folder)->histories();
  return histories.back().name == "rigid_wall_force" ? histories.back().ids.size() : 0;
}

void check_numbers(const D3plot& d, std::size_t walls) {
  const lbea::test::TemporaryFolder folder;
  const auto run = opened(d, folder);
  const auto histories = run->histories();
  REQUIRE(histories.size() == of_run.size() + of_part.size() + (walls > 0 ? 1 : 0));
  std::uint32_t place = 0;
  for (std::size_t h = 0; h < histories.size(); ++h) {
    const bool is_of_run = h < of_run.size(), is_of_part = !is_of_run && h < of_run.size() + of_part.size();
    CHECK(histories[h].name == (is_of_run ? of_run[h] : is_of_part ? of_part[h - of_run.size()] : "rigid_wall_force"));
    CHECK(histories[h].owner == (is_of_run ? HistoryOwner::run : is_of_part ? HistoryOwner::part : HistoryOwner::wall));
    if (is_of_part) CHECK(histories[h].ids == std::vector<std::uint32_t>{100, 200, 300, 400});
    const std::size_t history = is_of_run ? h : is_of_part ? 10 + h - of_run.size() : 20;
    for (std::size_t owner = 0; owner < histories[h].size(); ++owner, ++place)
      for (std::uint32_t s = run->states(); s-- > 0;) CHECK(run->history(s, place) == number(s, history, owner));
  }
  CHECK_THROWS_AS(static_cast<void>(run->history(run->states(), 0)), lbea::Error);
  CHECK_THROWS_AS(static_cast<void>(run->history(0, place)), lbea::Error);
}

}  // namespace

TEST_CASE("histories: every number of every state is the written one") {
  for (const std::size_t word_bytes : {4u, 8u})
    for (const std::size_t states_per_file : {0u, 2u})
      for (const std::size_t walls : {0u, 1u, 3u}) {
        CAPTURE(word_bytes);
        CAPTURE(walls);
        D3plot d = with_globals(3, walls);
        d.word_bytes = word_bytes;
        d.states_per_file = states_per_file;
        check_numbers(d, walls);
      }
}

TEST_CASE("histories: databases without numbering count their parts from 1") {
  D3plot d = with_globals(1);
  d.has_part_ids = false;
  const lbea::test::TemporaryFolder folder;
  CHECK(opened(d, folder)->histories().back().ids == std::vector<std::uint32_t>{1, 2, 3, 4});
}

TEST_CASE("histories: 8-byte words keep their precision, and what is not a number stays so") {
  D3plot d = with_globals(1);
  d.word_bytes = 8;
  d.states[0].globals[0] = 1.0 + 1e-12;
  d.states[0].globals[1] = std::numeric_limits<double>::quiet_NaN();
  const lbea::test::TemporaryFolder folder;
  const auto run = opened(d, folder);
  CHECK(run->history(0, 0) == 1.0 + 1e-12);
  CHECK(std::isnan(run->history(0, 1)));
}

// The writer's database is of version 971.
TEST_CASE("histories: the count of walls is certain, or there are fewer") {
  constexpr std::size_t without_walls = 6 + 7 * 4;
  CHECK(walls(with_words(without_walls + 3)) == 0);
  CHECK(walls(with_words(without_walls + 8)) == 2);
  const auto older = [](std::size_t words) {
    D3plot d = with_words(words);
    d.version = 960;
    return d;
  };
  CHECK(walls(older(without_walls + 3)) == 3);
  CHECK(walls(older(without_walls + 4)) == 1);  // 4 walls, or one with its position: the first word is a force
}

TEST_CASE("histories: globals that do not fit the parts give those of the run only, or none") {
  const std::vector<std::string> run_only(of_run.begin(), of_run.end());
  CHECK(names(with_words(6)) == run_only);
  CHECK(names(with_words(6 + 7 * 4 - 1)) == run_only);
  CHECK(names(with_words(5)).empty());
  CHECK(names(with_words(0)).empty());
  D3plot contradictory = with_globals(1);
  contradictory.overrides[24] = 3;  // NUMMAT8: with shells, the database would have 3 parts, not 4
  CHECK(names(contradictory) == run_only);
  contradictory.overrides[32] = 1;  // NUMMAT4
  CHECK(names(contradictory).size() == of_run.size() + of_part.size());
  contradictory.overrides[24] = -3;
  CHECK(names(contradictory).size() == of_run.size() + of_part.size());  // not known: NMMAT counts
  CHECK(names(sample_d3plot(0)).empty());                                // without states
}
