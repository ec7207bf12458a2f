// LS-DYNA keyword files that include others: ids, positions and refusals; thick shells.
#include <doctest/doctest.h>

#include "adapters/simulation/open.hpp"
#include "tests/simulation/opening.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {
namespace fs = std::filesystem;

const std::string square = "*KEYWORD\n*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT_SHELL\n1,1,1,2,3,4\n";

/// The position of the node with this id.
std::array<double, 3> position(const SimulationMesh& mesh, std::uint32_t id) {
  const auto node = static_cast<std::size_t>(std::ranges::find(mesh.node_ids, id) - mesh.node_ids.begin());
  REQUIRE(node < mesh.nodes());
  return {mesh.positions[3 * node], mesh.positions[3 * node + 1], mesh.positions[3 * node + 2]};
}

void check_near(const std::array<double, 3>& found, const std::array<double, 3>& expected) {
  for (std::size_t axis = 0; axis < 3; ++axis)
    CHECK(std::abs(found[axis] - expected[axis]) < 1e-6);  // of floats near 1
}
}  // namespace

TEST_CASE(
    "included files are part of the mesh: beside the file, beside the first one, or in a folder of *INCLUDE_PATH") {
  const TemporaryFolder folder;
  const fs::path main =
      put(folder / "main.k",
          "*KEYWORD\n*INCLUDE_PATH_RELATIVE\nelsewhere\n*INCLUDE\n$ two files\n  nodes.k\nsub\\\\shells.k\n"
          "*NODE\n4,0,1,0\n");
  put(folder / "nodes.k", "*NODE\n1,0,0,0\n2,1,0,0\n");
  put(folder.path() / "sub" / "shells.k", "*INCLUDE\nmore.k\nfur +\nther.k\n*ELEMENT_SHELL\n5,6,1,2,3,4\n");
  put(folder.path() / "sub" / "more.k", "*NODE\n3,1,1,0\n*END\n*NODE\n3,1,1,0\n");
  put(folder.path() / "elsewhere" / "further.k", "*NODE\n9,9,9,9\n");
  const auto run = open_simulation(main);
  CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{1, 2, 3, 4});
  CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{5});
  CHECK(run->files() == std::vector<fs::path>{main});
  CHECK(all_files(*run).size() == 5);
}

TEST_CASE("the columns of an included file are its own, and else those of the file that includes it") {
  const TemporaryFolder folder;
  const std::string wide(19, ' ');
  put(folder / "nodes.k", "*NODE\n" + wide + "1" + std::string(17, ' ') + "2.0\n" + wide + "2\n" + wide + "3\n");
  put(folder / "shells.k", "*KEYWORD I10=Y\n*ELEMENT_SHELL-\n       8       2       3       2       1\n");
  put(folder / "main.k", "*KEYWORD LONG=Y\n*INCLUDE\nnodes.k\nshells.k\n*ELEMENT_SHELL\n" + wide + "7" + wide + "1" +
                             wide + "1" + wide + "2" + wide + "3\n");
  const auto run = open_simulation(folder / "main.k");
  CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{7, 8});
  check_near(position(run->mesh(), 1), {2, 0, 0});
}

TEST_CASE("*INCLUDE_TRANSFORM shifts ids, scales and moves nodes; nested ones add up") {
  const TemporaryFolder folder;
  put(folder / "square.k", square);
  put(folder / "twice.k",
      "*INCLUDE\nsquare.k\n*INCLUDE_TRANSFORM\nsquare.k\n       100       200       300\n\n"
      "                           2.5\n\n");
  const std::string definition =
      "*DEFINE_TRANSFORMATION\n         7\nscale,2,,\nROTATE           0.0       0.0       3.0       1.0       0.0"
      "       0.0      90.0\nTRANSL           0.0       0.0       5.0\n";
  const auto run =
      open_simulation(put(folder / "main.k", definition + "*INCLUDE\ntwice.k\n*INCLUDE_TRANSFORM\ntwice.k\n"
                                                          "1000,2000,3000,4\n,,\n,,,,\n7\n"));
  const SimulationMesh& mesh = run->mesh();
  CHECK(mesh.nodes() == 16);
  CHECK(mesh.element_ids == std::vector<std::uint32_t>{1, 201, 2001, 2201});
  CHECK(mesh.element_parts == std::vector<std::uint32_t>{1, 301, 3001, 3301});
  check_near(position(mesh, 3), {1, 1, 0});
  check_near(position(mesh, 103), {2.5, 2.5, 0});
  // (1, 1, 0): x doubled, then turned by 90 degrees around (1, 0), then moved
  check_near(position(mesh, 1003), {0, 1, 5});
  check_near(position(mesh, 1103), {1 - 2.5, 4, 5});
}

TEST_CASE("transformations in the long format have columns of 20") {
  const TemporaryFolder folder;
  put(folder / "square.k", square);
  const auto wide = [](const std::vector<std::string>& fields) {
    std::string line;
    for (const std::string& field : fields) line += std::string(20 - field.size(), ' ') + field;
    return line + "\n";
  };
  const std::string definition = wide({"7"}) + wide({"TRANSL", "0.0", "5.0"});
  const std::string cards = wide({"1000", "2000", "3000"}) + "\n\n" + wide({"7"});
  for (const std::string& text :
       {"*KEYWORD LONG=Y\n*DEFINE_TRANSFORMATION\n" + definition + "*INCLUDE_TRANSFORM\nsquare.k\n" + cards,
        "*DEFINE_TRANSFORMATION+\n" + definition + "*INCLUDE_TRANSFORM+\nsquare.k\n" + cards}) {
    CAPTURE(text);
    const auto run = open_simulation(put(folder / "main.k", text));
    CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{2001});
    CHECK(run->mesh().element_parts == std::vector<std::uint32_t>{3001});
    check_near(position(run->mesh(), 1003), {1, 6, 0});
  }
}

TEST_CASE("transformations of included files are their own, with the offset IDDOFF") {
  const TemporaryFolder folder;
  put(folder / "square.k", square);
  const std::string define = "*DEFINE_TRANSFORMATION\n7\nTRANSL,0,0,", with_it = "\n,,\n,,\n7\n";
  put(folder / "up.k", define + "1\n*INCLUDE_TRANSFORM\nsquare.k\n100,100,100" + with_it);
  const auto text = [&](const std::string& offset) {
    return define + "5\n*INCLUDE_TRANSFORM\nup.k\n,,,,,," + offset + "\n,,\n,,\n\n*INCLUDE_TRANSFORM\nsquare.k\n0" +
           with_it;
  };
  const auto run = open_simulation(put(folder / "main.k", text("1000")));
  check_near(position(run->mesh(), 103), {1, 1, 1});
  check_near(position(run->mesh(), 3), {1, 1, 5});
  check_error(refusal(put(folder / "main.k", text(""))), Status::bad_input,
              {"up.k, line 3", "*DEFINE_TRANSFORMATION 7 is defined twice", "IDDOFF"});
  put(folder / "up.k", define + "5\n*INCLUDE_TRANSFORM\nsquare.k\n100,100,100" + with_it);
  check_near(position(open_simulation(folder / "main.k")->mesh(), 103), {1, 1, 5});  // the same one twice
}

TEST_CASE("included files that are not text in UTF-8 are refused, not skipped") {
  const TemporaryFolder folder;
  const fs::path main = put(folder / "main.k", square + "*INCLUDE\nmore.k\n");
  std::string wide;
  for (const char c : square) wide += {c, '\0'};
  put(folder / "more.k", wide);
  check_error(refusal(main), Status::unsupported_input, {"more.k", "UTF-16"});
  put(folder / "more.k", std::string("\x1f\x8b\x08\0\0\0\0\0", 8) + square);
  check_error(refusal(main), Status::unsupported_input, {"main.k, line 10", "more.k is not text", "unpack"});
}

TEST_CASE("rotations have any axis and point, blank factors are 1, other includes that add no mesh are skipped") {
  const TemporaryFolder folder;
  put(folder / "square.k", square);
  const auto moved = [&](const std::string& options) {
    const auto run =
        open_simulation(put(folder / "main.k", "*INCLUDE_STAMPED_PART\nresult.dyn\n*DEFINE_TRANSFORMATION\n7\n" +
                                                   options + "\n*INCLUDE_TRANSFORM\nsquare.k\n,,\n,,\n,,\n7\n"));
    return position(run->mesh(), 3);  // (1, 1, 0)
  };
  check_near(moved("ROTATE,0,0,2,0,0,0,90"), {-1, 1, 0});
  check_near(moved("ROTATE,0,1,0,0,1,0,90"), {0, 1, -1});
  check_near(moved("ROTATE,1,0,0,0,0,1,180"), {1, -1, 2});
  check_near(moved("SCALE,,,4\n\nTRANSL,0,0,1\nSCALE,,3,4"), {1, 3, 4});
}

TEST_CASE("what is wrong with included files is said with file and line") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::vector<std::string>& words,
                           Status status = Status::bad_input) {
    CAPTURE(text);
    check_error(refusal(put(folder / "main.k", "*KEYWORD\n" + text)), status, words);
  };
  put(folder / "square.k", square);
  refused("*INCLUDE\ngone.k\n", {"main.k, line 3: the included file gone.k is neither beside"}, Status::file_not_found);
  refused("*INCLUDE_PATH\nx\n*INCLUDE\ngone.k\n", {"main.k, line 5", "nor in a folder of *INCLUDE_PATH"},
          Status::file_not_found);
  refused("*INCLUDE\nmain.k\n", {"main.k, line 3: the included file", "includes this file"});
  put(folder / "b.k", "*INCLUDE\nc.k\n");
  put(folder / "c.k", "*PART\n*INCLUDE\nb.k\n");
  refused("*INCLUDE\nb.k\n", {"c.k, line 3: the included file", "b.k includes this file"});
  refused("*INCLUDE\nsquare.k\nsquare.k\n", {"square.k, line 3: node 1 is defined twice"});
  put(folder / "bad.k", "*NODE\n1,x,0,0\n");
  refused("*INCLUDE\nbad.k\n", {"bad.k, line 2", "not a number"});
  put(folder / "shell.k", "*ELEMENT_SHELL\n1,1,1,2,3,4\n");
  refused("*INCLUDE\nshell.k\n", {"shell.k, line 2: node 1 is not in these files"});
  for (const char* other : {"NASTRAN", "AUTO_OFFSET", "TRANSFORM_BINARY"})
    refused("*INCLUDE_" + std::string(other) + "\nsquare.k\n",
            {"main.k, line 2: *INCLUDE_" + std::string(other) + " is not read"}, Status::unsupported_input);
  for (int i = 0; i < 40; ++i)
    put(folder / ("d" + std::to_string(i) + ".k"), "*INCLUDE\nd" + std::to_string(i + 1) + ".k\n");
  refused("*INCLUDE\nd0.k\n", {"d30.k, line 2: files include one another more than 32 deep"});
  std::string wide;
  for (int i = 0; i < 101; ++i) wide += "x.k\n";
  put(folder / "x.k", "*PART\n");
  put(folder / "y.k", "*INCLUDE\n" + wide);
  std::string wider;
  for (int i = 0; i < 101; ++i) wider += "y.k\n";
  refused("*INCLUDE\n" + wider, {"more than 10000 files are included"});
}

TEST_CASE("transformations that are not read are refused, not left out") {
  const TemporaryFolder folder;
  put(folder / "square.k", square);
  const auto refused = [&](const std::string& text, const std::vector<std::string>& words,
                           Status status = Status::bad_input) {
    CAPTURE(text);
    check_error(refusal(put(folder / "main.k", text)), status, words);
  };
  const std::string define = "*DEFINE_TRANSFORMATION\n7\n", include = "*INCLUDE_TRANSFORM\nsquare.k\n";
  refused(define + "MIRROR,0,0,0,1,0,0\n", {"main.k, line 3", "\"MIRROR\"", "use TRANSL"}, Status::unsupported_input);
  refused(define + "ROTATE,1,2,90\n", {"line 3", "given by nodes"}, Status::unsupported_input);
  refused(define + "ROTATE,0,0,0,1,0,0,90\n", {"line 3", "no direction"});
  refused(define + "TRANSL,x\n", {"line 3", "\"x\" is not a number"});
  refused(include + "\n\n\n8\n", {"main.k, line 6", "*DEFINE_TRANSFORMATION 8 is not defined before"});
  refused(define + "TRANSL,1\n" + include + "\n\n,,25.4\n7\n", {"line 9", "FCTLEN and TRANID together"},
          Status::unsupported_input);
  refused(include + "x\n", {"line 3", "\"x\" is not an offset"});
  refused(include + "99999999999\n", {"line 3", "too large"});
  refused(include + "4294967295\n", {"square.k, line 3", "which is not an id"});
  refused(include + "-1\n", {"square.k, line 3", "id 1 with the offset -1", "is 0, which is not an id"});
}

TEST_CASE("thick shells are read as the solids that they are") {
  const TemporaryFolder folder;
  const std::string nodes =
      "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n5,0,0,1\n6,1,0,1\n7,1,1,1\n8,0,1,1\n9,2,0,0\n10,2,0,1\n";
  const std::string shells = "1,3,1,2,3,4,5,6,7,8\n", wedge = "2,3,2,9,3,3,6,10,7,7\n";
  const auto run = open_simulation(put(folder / "a.k", nodes + "*ELEMENT_TSHELL\n" + shells + wedge));
  CHECK(run->mesh().elements.size() == 5 + 4);  // the face between them is not part of the surface
  CHECK(std::ranges::count(run->mesh().element_ids, 2u) == 4);
  CHECK(open_simulation(put(folder / "b.k", nodes + "*ELEMENT_TSHELL_BETA\n" + shells + "0.5\n" + wedge + "0.5\n"))
            ->mesh()
            .elements == run->mesh().elements);
  check_error(refusal(put(folder / "c.k", nodes + "*ELEMENT_TSHELL\n1,3,1,2,3,4,5,6\n")), Status::bad_input,
              {"c.k, line 13", "eight nodes"});
  check_error(refusal(put(folder / "d.k", nodes + "*ELEMENT_TSHELL_COMPOSITE\n" + shells)), Status::unsupported_input,
              {"d.k, line 12", "*ELEMENT_TSHELL_COMPOSITE"});
}
