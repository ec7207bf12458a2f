// OpenRadioss animation files, as a writer made from the solver's converter lays them out.
#include <doctest/doctest.h>

#include <algorithm>

#include "adapters/simulation/open.hpp"
#include "tests/support/files.hpp"
#include "tests/support/radioss_writer.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {
namespace fs = std::filesystem;

/// Two shells and a brick below the first one; node 7 is the drawing of a wall. Everything that may be in the file is.
RadiossAnimation sample(float time) {
  RadiossAnimation a;
  a.time = time;
  a.has_masses = a.has_hierarchy = a.has_solids = true;
  a.frames = 2;
  for (const float z : {0.0f, -1.0f})
    for (const auto& [x, y] : {std::pair(0.0f, 0.0f), {1.0f, 0.0f}, {1.0f, 1.0f}, {0.0f, 1.0f}})
      a.positions.insert(a.positions.end(), {x, y, z + time});
  a.positions.insert(a.positions.end(), {2, 0, time, 9, 9, 9});
  a.node_ids = {108, 107, 106, 105, 104, 103, 102, 101, 109, 0};
  a.node_scalars = {{"Temperature", std::vector<float>(10, 20.0f + time)}};
  a.node_vectors = {{"Velocity", std::vector<float>(30, 1.0f)}};
  a.shells.nodes = {0, 1, 2, 3, 1, 8, 2, 2, 9, 9, 9, 9};
  a.shells.ids = {21, 20, 0};
  a.shells.alive = std::string{'\1', static_cast<char>(time < 1 ? 1 : 0), '\1'};
  a.shells.parts = {{1, "4: hood"}, {1, "5: empty"}, {3, "   12"}};
  a.shells.scalars = {{"Plastic Strain", {0.25f + time, 0.5f, 9.0f}}, {"Thickness", {1.5f, 2.5f, 9.0f}}};
  a.shells.tensors = 1;
  a.solids.nodes = {4, 5, 6, 7, 0, 1, 2, 3};
  a.solids.ids = {30};
  a.solids.alive = "\1";
  a.solids.parts = {{1, "6"}};
  a.solids.scalars = {{"Plastic Strain", {0.75f}}};
  a.solids.tensors = 2;
  return a;
}
}  // namespace

TEST_CASE("animation files are the states of a run: ids, parts, eroded elements, fields") {
  const TemporaryFolder folder;
  for (const float time : {0.0f, 1.0f})
    put(folder / (time == 0 ? "R004A001" : "R004A007"), RadiossWriter(sample(time)).bytes());
  put(folder / "R004T01", "history");
  const auto run = open_simulation(folder.path());
  const SimulationMesh& mesh = run->mesh();
  CHECK(mesh.node_ids == std::vector<std::uint32_t>{101, 102, 103, 104, 105, 106, 107, 108, 109});
  CHECK(mesh.element_ids == std::vector<std::uint32_t>{20, 21, 30, 30, 30, 30, 30, 30});
  CHECK(mesh.element_parts == std::vector<std::uint32_t>{12, 4, 6, 6, 6, 6, 6, 6});
  CHECK(mesh.elements[1] == Quad{7, 6, 5, 4});
  REQUIRE(run->states() == 2);
  CHECK(run->time_s(1) == 1);
  SimulationState state;
  run->read(1, state);
  CHECK(state.positions[3 * 7 + 2] == 1);  // node 108
  CHECK(state.alive == std::vector<std::uint8_t>{0, 1, 1, 1, 1, 1, 1, 1});
  const auto field = [&](const std::string& name) {
    const auto found = std::ranges::find(run->fields(), name, &SimulationField::name);
    REQUIRE(found != run->fields().end());
    return state.fields[static_cast<std::size_t>(found - run->fields().begin())];
  };
  CHECK(field("plastic_strain")[0] == 0.5f);
  CHECK(field("plastic_strain")[1] == 1.25f);
  CHECK(field("plastic_strain")[2] == 0.75f);
  CHECK(field("thickness")[0] == 2.5f);
  CHECK(field("thickness")[2] == 0);
  CHECK(field("temperature")[3] == 21);
}

TEST_CASE("animation files without ids, solids and results are counted") {
  const TemporaryFolder folder;
  RadiossAnimation a = sample(0.5f);
  a.has_masses = a.has_hierarchy = a.has_solids = a.has_ids = false;
  a.frames = 0;
  a.node_scalars.clear();
  a.node_vectors.clear();
  a.shells.scalars.clear();
  a.shells.tensors = 0;
  const auto run = open_simulation(put(folder / "A001", RadiossWriter(a).bytes()));
  CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{1, 2});
  CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{1, 2, 3, 4, 9});
  CHECK(run->fields().empty());
  CHECK(run->time_s(0) == 0.5);
}

TEST_CASE("animation files that are cut or damaged are refused") {
  const TemporaryFolder folder;
  const std::string whole = RadiossWriter(sample(0)).bytes();
  const auto refusal = [&](const std::string& bytes) {
    return error_of([&] { static_cast<void>(open_simulation(put(folder / "A001", bytes))); });
  };
  const std::size_t end_of_needed = whole.size() - 3 * 4;  // the last block is skipped
  for (std::size_t length = 251; length < end_of_needed; length += 13) {
    CAPTURE(length);
    check_error(refusal(whole.substr(0, length)), Status::bad_input, {"A001, byte", "cut short"});
  }
  const auto with = [&](auto change) {
    RadiossAnimation a = sample(0);
    change(a);
    return RadiossWriter(a).bytes();
  };
  check_error(refusal(with([](auto& a) { a.shells.parts[0].second = "hood"; })), Status::bad_input,
              {"part \"hood\" has no id"});
  check_error(refusal(with([](auto& a) { a.shells.parts[0].first = 2; })), Status::bad_input, {"ranges of parts"});
  check_error(refusal(with([](auto& a) { a.shells.nodes[1] = 10; })), Status::bad_input, {"cell 0: names point 10"});
  std::string negative = whole;
  negative[4 + 4 + 3 * 81 + 10 * 4] = '\xff';
  check_error(refusal(negative), Status::bad_input, {"A001, byte 295: a count is -"});
}
