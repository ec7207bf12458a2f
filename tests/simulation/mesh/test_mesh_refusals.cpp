// What is wrong with keyword, PLY, OBJ and STL meshes, a case per sentence; options of keyword files; series on disk.
#include <doctest/doctest.h>

#include "adapters/simulation/open.hpp"
#include "tests/simulation/opening.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <algorithm>

#include <sys/stat.h>
#include <unistd.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

namespace fs = std::filesystem;

void mesh_refused(const std::string& text, const std::vector<std::string>& words, Status status = Status::bad_input) {
  check_refused("a.mesh", text, words, status);
}

std::unique_ptr<SimulationReader> opened(const TemporaryFolder& folder, const std::string& text) {
  return open_simulation(put(folder / "a.mesh", text));
}

std::string ply(const std::string& elements, const std::string& rows) {
  return "ply\nformat ascii 1.0\n" + elements + "end_header\n" + rows;
}
const std::string vertices = "element vertex 3\nproperty float x\nproperty float y\nproperty float z\n";
const std::string faces = "element face 1\nproperty list uchar int vertex_index\n";

}  // namespace

TEST_CASE("keyword files: what is wrong is said with the line") {
  mesh_refused("*NODE\n1,0,0,0\n\n", {"line 3", "\"\" is not an id"});
  mesh_refused("*NODE\nx,0,0,0\n", {"line 2", "\"x\" is not an id"});
  mesh_refused("*NODE\n1,0,0,0\n*ELEMENT_SHELL\n1,1,1,1\n", {"line 4", "at least three nodes"});
  mesh_refused("*NODE\n1,0,0,0\n*ELEMENT_SOLID\n1\n", {"line 4", "a solid needs an id and a part"});
  mesh_refused("*NODE\n1,0,0,0\n*ELEMENT_SOLID\n1,1\n$ the nodes\n", {"within a solid"});
  mesh_refused("*KEYWORD\n*ELEMENT_SOLID_ORTHO\n", {"ELEMENT_SOLID_ORTHO"}, Status::unsupported_input);
  mesh_refused("*KEYWORD\n*ELEMENT_SHELL_BETA_COMPOSITE\n", {"BETA_COMPOSITE"}, Status::unsupported_input);
  for (const char* other : {"*1AB\n", "*A1B\n", "*A{B\n", "*_AB\n", "*AB\n", "*\n"})
    mesh_refused(other, {"none of the supported formats"}, Status::unsupported_input);
}

TEST_CASE("tetrahedra of ten nodes were read as hexahedra") {
  const std::string nodes =
      "*NODE\n1,0,0,0\n2,2,0,0\n3,0,2,0\n4,0,0,2\n5,1,0,0\n6,1,1,0\n7,0,1,0\n8,0,0,1\n9,1,0,1\n10,0,1,1\n";
  const std::string solid = nodes + "*ELEMENT_SOLID\n       1       1\n";
  const TemporaryFolder folder;
  const auto run =
      opened(folder, solid + "       1       2       3       4       5       6       7       8       9      10\n");
  CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{1, 2, 3, 4});
  CHECK(run->mesh().elements.size() == 4);
  CHECK(opened(folder, solid + "1,2,3,4,4,4,4,4,0,0\n")->mesh().elements.size() == 4);
  CHECK(opened(folder, nodes + "*ELEMENT_SOLID\n1,1,1,2,3,4,4,4,4,4,\n")->mesh().elements.size() == 4);
  mesh_refused(solid + "1,2,3,4,5,6,7,8,9\n", {"line 14", "nodes 9 and 10"});
  mesh_refused(solid + "1,2,3,4,5,6,7,8,8,8\n", {"line 14", "nodes 9 and 10"});
  mesh_refused(nodes + "*ELEMENT_SOLID\n1,1,1,2,3,4,5,6,7,8,9,10\n", {"line 13", "at most 10 nodes"});
}

TEST_CASE("shells without the cards of their option: every second one was skipped") {
  const std::string nodes = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT_SHELL_THICKNESS\n";
  const std::string shells[]{"       1       1       1       2       3       4\n",
                             "       2       1       1       2       3       4\n"};
  mesh_refused(nodes + shells[0] + shells[1], {"line 8", "this is a shell where the card of thicknesses"});
  mesh_refused(nodes + "1,1,1,2,3,4\n2,1,1,2,3,4\n", {"line 8", "this is a shell"});
  const TemporaryFolder folder;
  for (const char* card :
       {"             1.2             1.2             1.2             1.2\n", "1,1,1,1,0\n", "1,1,1,1\n",
        "               1               1               1               1               0\n"})
    CHECK(opened(folder, nodes + shells[0] + card + shells[1] + card)->mesh().elements.size() == 2);
}

TEST_CASE("keyword files with a byte order mark are read, in UTF-16 named") {
  const TemporaryFolder folder;
  const std::string text = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n*ELEMENT_SHELL\n1,1,1,2,3\n";
  CHECK(opened(folder, "\xef\xbb\xbf" + text)->mesh().elements.size() == 1);
  std::string wide = "\xff\xfe";
  for (const char c : text) wide += {c, '\0'};
  mesh_refused(wide, {"a.mesh: the text is in UTF-16; save it in UTF-8"}, Status::unsupported_input);
}

TEST_CASE("OBJ meshes: what is wrong is said with the line") {
  const std::string three = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
  mesh_refused(three + "f 1 2 \\\n3\n", {"line 4", "write the face in one line"});
  for (const std::string word : {"-4", "4294967296", "0", "1.5", "x"})
    mesh_refused(three + "f 1 2 " + word + "\n", {"line 4", "\"" + word + "\" is not a vertex"});
  mesh_refused(three + "f 1 2\n", {"line 4", "three vertices"});
}

TEST_CASE("keyword files: widths of fields, by file and by card, and cards that belong to an element") {
  const TemporaryFolder folder;
  const auto column = [](int width, const std::string& text) {
    return std::string(static_cast<std::size_t>(width) - text.size(), ' ') + text;
  };
  const auto node = [&](int integer, int real, const std::string& id, const std::string& x, const std::string& y) {
    return column(integer, id) + column(real, x) + column(real, y) + column(real, "0") + "\n";
  };
  const auto shell = [&](int width) {
    return column(width, "1") + column(width, "2") + column(width, "11") + column(width, "12") + column(width, "13") +
           column(width, "0") + "\n";
  };
  const auto nodes = [&](int integer, int real) {
    return node(integer, real, "11", "0", "0") + node(integer, real, "12", "1", "0") +
           node(integer, real, "13", "", "1");
  };
  for (const std::string& text :
       {"*KEYWORD LONG=Y\n*NODE\n" + nodes(20, 20) + "*ELEMENT_SHELL\n" + shell(20),
        "*KEYWORD I10=Y\n*NODE\n" + nodes(10, 16) + "*ELEMENT_SHELL\n" + shell(10),
        "*KEYWORD LONG=Y\n*NODE-\n" + nodes(8, 16) + "*ELEMENT_SHELL-\n" + shell(8),
        "*KEYWORD\n*NODE %\n" + nodes(8, 16) + "*element_shell%\n" + shell(10),
        "*KEYWORD\n*NODE\n" + nodes(8, 16) + "*ELEMENT_SHELL_OFFSET_MCID_DOF\n" + shell(8) + "mcid\noffset\ndof\n",
        "*keyword long=y\n*node\n" + nodes(20, 20) + "*element_shell\n" + shell(20) + "*end\n*NODE\n1,0,0,0\n",
        "*KEYWORD\n*NODE\n" + nodes(8, 16) + "*ELEMENT_SHELL\n1,2,11,12,13,,\n",
        "*KEYWORD\n\n*NODE\n" + nodes(8, 16) + "*ELEMENT_SHELL_THICKNESS_BETA\n" + shell(8) + "thickness\n"}) {
    CAPTURE(text);
    const auto run = opened(folder, text);
    CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{11, 12, 13});
    CHECK(run->mesh().positions == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
    CHECK(run->mesh().element_parts == std::vector<std::uint32_t>{2});
    CHECK(run->mesh().elements[0] == std::array<std::uint32_t, 4>{0, 1, 2, 2});
  }
  const auto run = opened(
      folder, "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT_SOLID\n1,7\n$ on a card of its own\n1,2,3,4\n");
  CHECK(run->mesh().elements.size() == 4);  // a tetrahedron
  CHECK(
      opened(folder, "*NODE\n1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n*ELEMENT_SOLID\n1,7,1,2,3,4,,,,\n")->mesh().elements ==
      run->mesh().elements);
}

TEST_CASE("PLY meshes: what is wrong is said with the byte") {
  mesh_refused(ply("element vertex 1\nproperty float x\nproperty float y\n" + faces, "0 0\n3 0 0 0\n"), {"x, y and z"});
  mesh_refused(ply(vertices + faces, "0 0 0 1 0 0 0 1 0\n3 0 1 -2\n"), {"a vertex that does not exist"});
  mesh_refused(ply(vertices + faces, "0 0 0 1 0 0 0 1 0\n3 0 1 4294967295\n"), {"a vertex that does not exist"});
  mesh_refused(ply(vertices + faces, "0 0 1e999 1 0 0 0 1 0\n3 0 1 2\n"), {"node 1", "not a number"});
  mesh_refused("ply", {"none of the supported formats"}, Status::unsupported_input);
  mesh_refused("plywood\n", {"none of the supported formats"}, Status::unsupported_input);
  mesh_refused(ply(vertices + faces, "0 0 0 1 0 0 0 1 0\n2 0 1\n"), {"fewer than three vertices"});
  mesh_refused(ply(vertices + faces, "0 0 0 1 0 0 0 1 0\n3 0 x 2\n"), {"expected a number"});
  mesh_refused(ply(vertices + faces, "0 0 0 1 0 0 0 1 0\n3 0 1"), {"cut short"});
  mesh_refused(
      ply(vertices + "element face 1000\nproperty list uchar int vertex_index\n", "0 0 0 1 0 0 0 1 0\n3 0 1 2\n"),
      {"declares 1000 rows"});
  mesh_refused(ply(vertices + "element face 1\n", "0 0 0 1 0 0 0 1 0\n"), {"\"face\" has no properties"});
  mesh_refused(
      ply("element vertex 3\nproperty float x\nproperty float y\nproperty float z\nproperty list uchar int more\n" +
              faces,
          "0 0 0 0 1 0 0 0 0 1 0 0\n3 0 1 2\n"),
      {"PLY"}, Status::unsupported_input);
}

TEST_CASE("PLY meshes: line ends of Windows, tabs, a blank behind the first word") {
  const TemporaryFolder folder;
  const std::string text = ply(vertices + "property float {\n" + faces, "0 0 0 1\n1 0 0 2\n0 1 0 3\n3 0 1 2\n");
  std::string windows;
  for (const char c : text) windows += c == '\n' ? "\r\n" : std::string(1, c);
  std::string tabs = text;
  std::replace(tabs.begin() + static_cast<std::ptrdiff_t>(tabs.find("0 0 0 1")), tabs.end(), ' ', '\t');
  for (const std::string& same : {text, windows, tabs, "ply " + text.substr(3)}) {
    CAPTURE(same);
    const auto run = opened(folder, same);
    CHECK(run->mesh().positions == std::vector<float>{0, 0, 0, 1, 0, 0, 0, 1, 0});
    CHECK(run->mesh().elements == std::vector<std::array<std::uint32_t, 4>>{{0, 1, 2, 2}});
    CHECK(run->fields().size() == 1);
  }
}

TEST_CASE("PLY meshes: other elements and properties are passed over") {
  const TemporaryFolder folder;
  const auto run =
      opened(folder, ply("comment x\nelement camera 1\nproperty float a\nproperty list uchar float b\n" + vertices +
                             "property float plastic_strain\n" +
                             "element face 2\nproperty uchar red\nproperty list uchar float uv\nproperty list uchar "
                             "int vertex_indices\nelement edge 1\nproperty int a\n",
                         "1 2 5 6\n0 0 0 0.5\n1 0 0 0.5\n0 1 0 0.5\n255 2 0.5 0.5 3 0 1 2\n0 0 3 2 1 0\n4\n"));
  CHECK(run->mesh().elements.size() == 2);
  REQUIRE(run->fields().size() == 1);
  SimulationState state;
  run->read(0, state);
  CHECK(state.fields[0][1] == 0.5f);
}

TEST_CASE("files that cannot be read are told from files that are not there") {
  const TemporaryFolder folder;
  check_error(error_of([&] { static_cast<void>(find_series(folder / "absent1.vtk")); }), Status::file_not_found,
              {"absent1.vtk", "check the path"});
  check_error(error_of([&] { static_cast<void>(open_d3plot(folder / "absent")); }), Status::file_not_found,
              {"absent", "check the path"});
  REQUIRE(::mkfifo((folder / "fifo").c_str(), 0600) == 0);
  check_error(error_of([&] { static_cast<void>(open_d3plot(folder / "fifo")); }), Status::bad_input,
              {"fifo", "not a regular file"});
  if (::geteuid() != 0) {
    const fs::path secret = put(folder / "secret", "x");
    fs::permissions(secret, fs::perms::none);
    check_error(error_of([&] { static_cast<void>(open_d3plot(secret)); }), Status::file_not_found, {"permissions"});
  }
}

TEST_CASE("a series is the files whose names differ in one number alone, by its value") {
  const TemporaryFolder folder;
  for (const char* name : {"a10.vtk", "a9.vtk", "a009.vtk", "a1.vtu", "b1.vtk", "a.vtk", "7.vtk", "08.vtk"})
    put(folder / name, "");
  fs::create_directory(folder / "a11.vtk");
  CHECK(find_series(folder / "a10.vtk") ==
        std::vector<fs::path>{folder / "a9.vtk", folder / "a009.vtk", folder / "a10.vtk"});
  CHECK(find_series(folder / "a.vtk") == std::vector<fs::path>{folder / "a.vtk"});
  CHECK(find_series(folder / "7.vtk") == std::vector<fs::path>{folder / "7.vtk", folder / "08.vtk"});
  CHECK(first_files(folder.path()) == std::vector<fs::path>{folder / "7.vtk", folder / "a9.vtk", folder / "a.vtk",
                                                            folder / "a1.vtu", folder / "b1.vtk"});
  CHECK(first_files(folder / "absent").empty());
  const fs::path before = fs::current_path();
  fs::current_path(folder.path());
  const auto relative = find_series("a9.vtk");
  fs::current_path(before);
  CHECK(relative.front() == "a9.vtk");
}
