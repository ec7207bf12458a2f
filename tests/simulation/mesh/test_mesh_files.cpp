// Meshes and sequences of meshes: LS-DYNA keyword, OBJ, PLY, STL; told by content.
#include <doctest/doctest.h>

#include <bit>
#include <cstring>

#include "adapters/simulation/open.hpp"
#include "tests/simulation/opening.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

namespace fs = std::filesystem;
using Quad = std::array<std::uint32_t, 4>;

/// Two triangles that share an edge, in binary STL; the header begins like a text file's.
std::string stl(float z, bool is_torn = false) {
  std::string bytes = "solid of an exporter that does not care";
  bytes.resize(80, ' ');
  const auto add = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  add(std::uint32_t{2});
  const auto triangle = [&](std::array<float, 9> corners) {
    for (const float normal : {0.0f, 0.0f, 1.0f}) add(normal);
    for (const float value : corners) add(value);
    add(std::uint16_t{0});
  };
  triangle({0, 0, z, 1, 0, 0, 0, 1, 0});
  triangle({1, 0, is_torn ? 0.5f : 0.0f, 1, 1, 0, -0.0f, 1, 0});
  return bytes;
}

}  // namespace

TEST_CASE("a keyword file's shells and solids are a mesh") {
  const TemporaryFolder folder;
  const fs::path file =
      put(folder / "mesh.txt",
          "$ made by hand\n*KEYWORD\n*PART\nhood\n        12         3\n*NODE\n"
          "$    id               x               y               z\n"
          "      11             0.0             0.0             0.0       0       0\n"
          "      13             1.0             0.0           1.5e0\n"
          "      12             1.0             1.0             0.0\n"
          "14,0,1,0\n"
          "*ELEMENT_SHELL_THICKNESS\n"
          "       5      12      11      13      12      14\n"
          "             0.8             0.8             0.8             0.8\n"
          "       4       7      11      13      12      12\n"
          "             0.8             0.8             0.8             0.8\n"
          "*NODE+\n                  21                 0.0                 0.0                 5.0\n"
          "*ELEMENT_SOLID\n       9       1\n      11      13      12      21      21      21      21      21\n*END\n");
  const auto run = open_simulation(file);
  const SimulationMesh& mesh = run->mesh();
  CHECK(mesh.node_ids == std::vector<std::uint32_t>{11, 12, 13, 14, 21});
  CHECK(mesh.positions[3 * 2 + 2] == 1.5f);
  CHECK(mesh.element_ids == std::vector<std::uint32_t>{4, 5, 9, 9, 9, 9});
  CHECK(mesh.element_parts[0] == 7);
  CHECK(mesh.elements[0] == Quad{0, 2, 1, 1});
  CHECK(mesh.elements[1] == Quad{0, 2, 1, 3});
  CHECK(run->states() == 1);
  CHECK(run->time_s(0) == 0);
}

TEST_CASE("what a keyword file lacks is said with the line") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text) { return refusal(put(folder / "a.k", text)); };
  check_error(refused("*KEYWORD\n*ELEMENT_SHELL\n1,1,2,3,4\n"), Status::bad_input, {"a.k, line 3", "node 2"});
  check_error(refused("*NODE\n1,a,0,0\n"), Status::bad_input, {"line 2", "number"});
  check_error(refused("*NODE\n1,0,0,0\n1,0,0,0\n"), Status::bad_input, {"line 3", "node 1 is defined twice"});
  check_error(refused("*ELEMENT_SHELL_COMPOSITE\n"), Status::unsupported_input, {"line 1", "COMPOSITE"});
  check_error(refused("*KEYWORD\n*PART\n"), Status::unsupported_input, {"no *ELEMENT_SHELL, *ELEMENT_SOLID or"});
}

TEST_CASE("a node's blank coordinates at the end of a card were refused instead of read as 0") {
  const TemporaryFolder folder;
  const auto run =
      open_simulation(put(folder / "a.k",
                          "*NODE\n       1\n       2             1.0\n"
                          "       3             1.0             1.0\n       4                             1.0\n"
                          "*ELEMENT_SHELL\n       1       1       1       2       3       4\n"));
  CHECK(run->mesh().positions == std::vector<float>{0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0});
}

TEST_CASE("numbered OBJ files are a run") {
  const TemporaryFolder folder;
  const auto obj = [](const std::string& z) {
    return "# comment\no plate\nv 0 0 " + z +
           "\nv 1 0 0 0.5 0.5 0.5\nv 1 1 0\nv 0 1 0\nvn 0 0 1\nf 1//1 2//1 3//1 -1//1\nf 1 2 3\n";
  };
  put(folder / "s_1.obj", obj("0"));
  put(folder / "s_2.obj", obj("-2"));
  const auto run = open_simulation(folder.path());
  CHECK(run->mesh().elements == std::vector<Quad>{{0, 1, 2, 3}, {0, 1, 2, 2}});
  REQUIRE(run->states() == 2);
  SimulationState state;
  run->read(1, state);
  CHECK(state.time_s == 1);
  CHECK(state.positions[2] == -2);
  put(folder / "s_2.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n");
  check_error(error_of([&] { open_simulation(folder.path())->read(1, state); }), Status::bad_input,
              {"s_2.obj", "3 points and 1 cells", "s_1.obj", "4 points and 2 cells"});
  check_error(refusal(put(folder / "t.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 9\n")), Status::bad_input,
              {"t.obj", "point 8"});
  check_error(refusal(put(folder / "n.obj", "v nan 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n")), Status::bad_input,
              {"n.obj", "node 1"});
  check_error(refusal(put(folder / "u.obj", "v 0 0 0\nf 1 0 1\n")), Status::bad_input, {"u.obj, line 2"});
}

TEST_CASE("PLY meshes, in text and binary") {
  const TemporaryFolder folder;
  const std::string tail =
      "element vertex 3\nproperty float x\nproperty float y\nproperty double z\nproperty uchar red\n"
      "element face 1\nproperty list uchar int vertex_indices\nproperty int group\nend_header\n";
  const fs::path text =
      put(folder / "a.ply", "ply\nformat ascii 1.0\n" + tail + "0 0 0.5 9\n1 0 0 9\n0 1 0 9\n3 0 1 2 77\n");
  std::string bytes = "ply\nformat binary_little_endian 1.0\n" + tail;
  const auto add = [&](auto value) { bytes.append(reinterpret_cast<const char*>(&value), sizeof value); };
  for (const auto& [x, y, z] : {std::array{0.0f, 0.0f, 0.5f}, {1.0f, 0.0f, 0.0f}, {0.0f, 1.0f, 0.0f}})
    add(x), add(y), add(static_cast<double>(z)), add(std::uint8_t{9});
  add(std::uint8_t{3});
  for (const std::int32_t value : {0, 1, 2, 77}) add(value);
  for (const fs::path& file : {text, put(folder / "b.ply", bytes)}) {
    CAPTURE(file.string());
    const auto run = open_simulation(file);
    CHECK(run->mesh().elements == std::vector<Quad>{{0, 1, 2, 2}});
    CHECK(run->mesh().positions == std::vector<float>{0, 0, 0.5f, 1, 0, 0, 0, 1, 0});
  }
  for (std::size_t length = 4; length < bytes.size(); ++length) {
    CAPTURE(length);
    CHECK(refusal(put(folder / "c.ply", bytes.substr(0, length))).status != Status::ok);
  }
  check_error(refusal(put(folder / "cloud.ply",
                          "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\n"
                          "property float z\nend_header\n1 2 3\n")),
              Status::unsupported_input, {"no surface"});
}

TEST_CASE("STL triangles are joined where coordinates are equal, and stay joined") {
  const TemporaryFolder folder;
  put(folder / "a1.stl", stl(0));
  put(folder / "a2.stl", stl(3));
  const auto run = open_simulation(folder.path());
  CHECK(run->mesh().nodes() == 4);
  CHECK(run->mesh().elements.size() == 2);
  SimulationState state;
  run->read(1, state);
  CHECK(state.positions[2] == 3);
  put(folder / "a2.stl",
      "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n");
  check_error(error_of([&] { open_simulation(folder.path())->read(1, state); }), Status::bad_input,
              {"a2.stl", "3 points and 1 cells", "a1.stl"});
  put(folder / "a2.stl", stl(3, true));
  check_error(error_of([&] { open_simulation(folder.path())->read(1, state); }), Status::bad_input,
              {"a2.stl, triangle 1", "a1.stl"});
  const fs::path text = put(folder / "b.stl",
                            "solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\n"
                            "endloop\nendfacet\nendsolid\n");
  CHECK(open_simulation(text)->mesh().nodes() == 3);
  check_error(refusal(put(folder / "c.stl", "solid\nfacet\nvertex 0 0 0\nvertex 1 0 0\n")), Status::bad_input,
              {"cut short"});
}

TEST_CASE("files that are nothing of this are refused with the formats that are read") {
  const TemporaryFolder folder;
  for (const char* text : {"", "hello\n", "<html></html>", "{\"a\": 1}", "x,y,z\n1,2,3\n", "%PDF-1.4\n"})
    check_error(refusal(put(folder / "a", text)), Status::unsupported_input, {"d3plot", "VTK legacy", "OBJ"});
  check_error(refusal(folder.path()), Status::file_not_found, {"d3plot"});
  CHECK(contains(list_simulation_formats(), ".pvd"));
}
