// Public and rail databases against what an independent reader found in them (expected.json).
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <numeric>
#include <set>

#include <nlohmann/json.hpp>

#include <lbea/lbea.hpp>
#include "adapters/simulation/d3plot/database.hpp"

#include "adapters/simulation/open.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

namespace fs = std::filesystem;
using lbea::io::d3plot::Database;
using lbea::io::d3plot::StateFile;
using nlohmann::json;

namespace {

fs::path folder() { return lbea::test::reference_data() / "d3plot"; }

json expected_values() {
  std::ifstream in(folder() / "expected.json");
  return json::parse(in);
}

/// The values of an array against its entry: element count, sum, extrema, first row.
void check(const json& expected, const std::vector<double>& values) {
  std::size_t size = 1;
  for (const auto& extent : expected["shape"]) size *= extent.get<std::size_t>();
  REQUIRE(values.size() == size);
  if (values.empty()) return;
  // the oracle's sum may have been taken in another order: n rounding errors of the largest partial sum at most
  const double magnitude =
      std::accumulate(values.begin(), values.end(), 0.0, [](double sum, double v) { return sum + std::abs(v); });
  const double tolerance = 2 * static_cast<double>(values.size()) * 1.2e-16 * magnitude;
  CHECK(std::abs(std::accumulate(values.begin(), values.end(), 0.0) - expected["sum"].get<double>()) <= tolerance);
  CHECK(*std::min_element(values.begin(), values.end()) == expected["min"].get<double>());
  CHECK(*std::max_element(values.begin(), values.end()) == expected["max"].get<double>());
  if (expected.contains("first_row"))
    for (std::size_t i = 0; i < expected["first_row"].size(); ++i)
      CHECK(values[i] == expected["first_row"][i].get<double>());
  if (expected.contains("last_state_first_row")) {
    const std::size_t last =
        values.size() / expected["shape"][0].get<std::size_t>() * (expected["shape"][0].get<std::size_t>() - 1);
    for (std::size_t i = 0; i < expected["last_state_first_row"].size(); ++i)
      CHECK(values[last + i] == expected["last_state_first_row"][i].get<double>());
  }
}

template <typename Container>
std::vector<double> doubles(const Container& values) {
  return {values.begin(), values.end()};
}

template <std::size_t Corners>
std::vector<double> corners(const lbea::io::d3plot::Elements<Corners>& elements) {
  std::vector<double> all;
  for (const auto& nodes : elements.nodes) all.insert(all.end(), nodes.begin(), nodes.end());
  return all;
}

template <std::size_t Corners>
std::vector<double> part_indices(const lbea::io::d3plot::Elements<Corners>& elements) {
  std::vector<double> all = doubles(elements.parts);
  for (double& part : all) part -= 1;
  return all;
}

/// Words [start, start + count) of every state, one after the other.
std::vector<double> in_all_states(const Database& database, std::uint64_t start, std::uint64_t count) {
  StateFile file(database);
  std::vector<double> all;
  std::vector<float> words(count);
  for (const auto& place : database.states) {
    file.read(place, start, words);
    all.insert(all.end(), words.begin(), words.end());
  }
  return all;
}

std::vector<double> plastic_strains(const Database& database, const lbea::io::d3plot::Block& block,
                                    const lbea::io::d3plot::RowFields& row) {
  const auto words = in_all_states(database, block.start, block.rows * block.row_words);
  std::vector<double> all;
  for (std::size_t at = 0; at < words.size(); at += block.row_words)
    for (std::size_t p = 0; p < row.points; ++p) all.push_back(words[at + *row.plastic_strain + p * row.point_words]);
  return all;
}

void check_database(const std::string& name, const json& expected) {
  CAPTURE(name);
  const Database database = lbea::io::d3plot::open_database(folder() / name / "d3plot");
  const auto& geometry = database.geometry;
  CHECK(database.word_bytes == expected["word_size"].get<std::uint64_t>());
  check(expected["node_coordinates"], doubles(geometry.positions));
  check(expected["node_ids"], doubles(geometry.node_ids));
  check(expected["element_shell_node_indexes"], corners(geometry.shells));
  check(expected["element_solid_node_indexes"], corners(geometry.solids));
  check(expected["element_shell_part_indexes"], part_indices(geometry.shells));
  check(expected["element_solid_part_indexes"], part_indices(geometry.solids));
  check(expected["element_shell_ids"], doubles(geometry.shells.ids));
  check(expected["element_solid_ids"], doubles(geometry.solids.ids));

  std::vector<double> times;
  for (const auto& place : database.states) times.push_back(place.time_s);
  CHECK(times == expected["timesteps"]["values"].get<std::vector<double>>());
  check(expected["node_displacement"], in_all_states(database, database.layout.positions, database.header.nodes * 3));
  const auto& layout = database.layout;
  if (expected.contains("element_shell_effective_plastic_strain"))
    check(expected["element_shell_effective_plastic_strain"], plastic_strains(database, layout.shells, layout.shell));
  if (expected.contains("element_solid_effective_plastic_strain"))
    check(expected["element_solid_effective_plastic_strain"], plastic_strains(database, layout.solids, layout.solid));
  if (expected.contains("element_shell_is_alive"))
    check(expected["element_shell_is_alive"], in_all_states(database, layout.shell_flags, database.header.shells));
  if (expected.contains("element_solid_is_alive"))
    check(expected["element_solid_is_alive"], in_all_states(database, layout.solid_flags, database.header.solids));
}

lbea::Status status_of(const fs::path& path, std::string& sentence) {
  const lbea::Error error = lbea::test::error_of([&] { static_cast<void>(lbea::io::open_simulation(path)); });
  sentence = error.what();
  return error.status;
}

}  // namespace

TEST_CASE("every value of the public databases agrees with an independent reader") {
  const json expected = expected_values();
  for (const char* name : {"ansys_beam", "ansys_block", "lasso_simple", "lasso_solid_shell"})
    check_database(name, expected[name]);
}

// The parts' energies add up to the run's. So do their momenta, but for the solver's rounding and the half step between
// velocities and energies; components or parts that are mixed up would differ by as much as they are.
TEST_CASE("histories of parts add up to those of the run, in every state of the public databases") {
  for (const char* name : {"ansys_beam", "lasso_solid_shell"}) {
    CAPTURE(name);
    const auto run = lbea::io::open_simulation(folder() / name);
    const std::size_t parts = run->histories()[6].size();
    REQUIRE(run->histories().size() == 13);
    CHECK(run->histories()[6].ids ==
          (parts == 2 ? std::vector<std::uint32_t>{1, 2} : std::vector<std::uint32_t>{1000, 2000, 3000, 4000}));
    constexpr double unloaded = 1e-15;  // the solver begins with a tiny energy per element
    double fastest = 0;
    for (std::uint32_t s = 0; s < run->states(); ++s)
      for (std::uint32_t axis = 3; axis < 6; ++axis) fastest = std::max(fastest, std::abs(run->history(s, axis)));
    for (std::uint32_t s = 0; s < run->states(); ++s) {
      const auto of_part = [&](std::size_t history, std::size_t part) {
        return run->history(s, static_cast<std::uint32_t>(6 + history * parts + part));
      };
      double internal = 0, kinetic = 0, mass = 0;
      std::array<double, 3> momentum{};
      for (std::size_t part = 0; part < parts; ++part) {
        internal += of_part(0, part);
        kinetic += of_part(1, part);
        mass += of_part(5, part);
        for (std::size_t axis = 0; axis < 3; ++axis) momentum[axis] += of_part(5, part) * of_part(2 + axis, part);
      }
      const double total = run->history(s, 2);
      CHECK(std::abs(run->history(s, 0) + run->history(s, 1) - total) <= 1e-6 * total);
      CHECK(std::abs(internal - run->history(s, 1)) <= 1e-6 * total + unloaded);
      CHECK(std::abs(kinetic - run->history(s, 0)) <= 1e-3 * total);
      for (std::uint32_t axis = 0; axis < 3; ++axis)
        CHECK(std::abs(momentum[axis] / mass - run->history(s, 3 + axis)) <= 1e-3 * fastest);
    }
  }
}

// In the first state of ansys_beam the bricks fly, and the beams stand still.
TEST_CASE("histories of a part that flies agree with the velocities of its nodes") {
  const Database database = lbea::io::d3plot::open_database(folder() / "ansys_beam" / "d3plot");
  const auto run = lbea::io::open_simulation(folder() / "ansys_beam");
  const std::uint32_t part = database.geometry.solids.parts.front() - 1;
  const auto of_part = [&](std::uint32_t history) { return run->history(0, 6 + 2 * history + part); };
  std::vector<float> velocities(3 * database.header.nodes);
  StateFile(database).read(database.states.front(), database.layout.positions + velocities.size(), velocities);
  double squared = 0;
  for (std::uint32_t axis = 0; axis < 3; ++axis) {
    const double speed = of_part(2 + axis);
    squared += speed * speed;
    for (const auto& corners : database.geometry.solids.nodes)
      for (const std::uint32_t node : corners) REQUIRE(double{velocities[3 * node + axis]} == speed);
  }
  CHECK(squared == 100);
  CHECK(of_part(1) == doctest::Approx(0.5 * of_part(5) * squared).epsilon(1e-5));
}

TEST_CASE("databases without surface or deformation, and compressed ones, are refused in words") {
  std::string sentence;
  CHECK(status_of(folder() / "lasso_temperature", sentence) == lbea::Status::unsupported_input);
  CHECK(sentence.find("IU = 0") != std::string::npos);
  CHECK(status_of(folder() / "lasso_beam", sentence) == lbea::Status::unsupported_input);
  CHECK(sentence.find("surface") != std::string::npos);
  CHECK(status_of(folder() / "femzip" / "d3plot.fz", sentence) == lbea::Status::unsupported_input);
  CHECK(sentence.find("FEMZIP") != std::string::npos);
  CHECK(status_of(folder() / "lasso_order", sentence) == lbea::Status::bad_input);
  CHECK(sentence.find("d3plot03 is missing, but d3plot10 is there") != std::string::npos);
  CHECK(status_of(folder() / "lasso_order" / "d3plot01", sentence) == lbea::Status::unsupported_input);
  CHECK(status_of(folder() / "expected.json", sentence) == lbea::Status::unsupported_input);
  CHECK(status_of(folder() / "femzip", sentence) == lbea::Status::unsupported_input);
  CHECK(sentence.find("FEMZIP") != std::string::npos);
}

TEST_CASE("the surface of the mixed database keeps the solver's ids and maps plastic strain by the largest layer") {
  const Database database = lbea::io::d3plot::open_database(folder() / "lasso_solid_shell" / "d3plot");
  const auto run = lbea::io::open_simulation(folder() / "lasso_solid_shell");
  REQUIRE(run->states() == 22);
  CHECK(run->files().size() == 23);
  const auto& mesh = run->mesh();
  REQUIRE(run->fields().front().name == "plastic_strain");
  CHECK(std::set<std::uint32_t>(mesh.element_parts.begin(), mesh.element_parts.end()) ==
        std::set<std::uint32_t>{1000, 2000, 3000, 4000});

  lbea::bake::SimulationState state;
  run->read(21, state);
  // shell 17 is the first: its five layers are in expected.json, the largest is the last
  CHECK(mesh.element_ids.front() == 17);
  CHECK(state.fields[0][0] == doctest::Approx(0.11421913653612137).epsilon(1e-7));
  // solid 1 has eight points, the largest 0.03695279732346535
  const auto solid = std::find(mesh.element_ids.begin(), mesh.element_ids.end(), 1u);
  REQUIRE(solid != mesh.element_ids.end());
  CHECK(state.fields[0][static_cast<std::size_t>(solid - mesh.element_ids.begin())] ==
        doctest::Approx(0.03695279732346535).epsilon(1e-7));
  CHECK(std::count(state.alive.begin(), state.alive.end(), 1) == static_cast<std::ptrdiff_t>(mesh.elements.size()));
}

TEST_CASE("every rail run has the same mesh, 31 states of 0.5 ms, and starts undeformed") {
  const fs::path rail = lbea::test::reference_data() / "rail" / "runs";
  std::size_t runs = 0;
  for (const auto& entry : fs::directory_iterator(rail)) {
    CAPTURE(entry.path().string());
    const auto run = lbea::io::open_simulation(entry.path());
    REQUIRE(run->states() == 31);
    CHECK(run->mesh().nodes() == 2436);
    CHECK(run->mesh().elements.size() == 2394);
    CHECK(run->files().size() == 2);
    REQUIRE(run->fields().size() == 1);
    CHECK(run->fields()[0].name == "plastic_strain");
    CHECK(std::set<std::uint32_t>(run->mesh().element_parts.begin(), run->mesh().element_parts.end()) ==
          std::set<std::uint32_t>{1, 2, 3, 4, 5});
    lbea::bake::SimulationState state;
    run->read(0, state);
    CHECK(state.positions == run->mesh().positions);
    CHECK(*std::max_element(state.fields[0].begin(), state.fields[0].end()) == 0.0f);
    run->read(30, state);
    CHECK(state.time_s == doctest::Approx(0.015).epsilon(1e-6));
    CHECK(*std::max_element(state.fields[0].begin(), state.fields[0].end()) > 0.1f);
    ++runs;
  }
  CHECK(runs == 40);
}
