// Parallel VTK files: pieces become one mesh, whose nodes on their borders are not doubled. test_vtk_encodings.cpp
// reads pieces that VTK has written.
#include <doctest/doctest.h>

#include "adapters/simulation/grid/grid_reader.hpp"
#include "adapters/simulation/open.hpp"
#include "tests/simulation/opening.hpp"
#include "tests/simulation/vtk/vtk_text.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <ctime>
#include <regex>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {
namespace fs = std::filesystem;

std::string naming(const std::vector<std::string>& pieces, const std::string& type = "PPolyData") {
  std::string text = "<VTKFile type=\"" + type + "\"><" + type + ">";
  for (const std::string& piece : pieces) text += "<Piece Source=\"" + piece + "\"/>";
  return text + "</" + type + "></VTKFile>";
}

/// Triangles by the indices of their corners, with arrays of points and cells.
std::string piece(int points, const std::string& positions, int triangles, const std::string& corners,
                  const std::string& point_arrays = "", const std::string& cell_arrays = "") {
  std::string ends;
  for (int t = 1; t <= triangles; ++t) ends += std::to_string(3 * t) + " ";
  return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"" + std::to_string(points) +
         "\" NumberOfPolys=\"" + std::to_string(triangles) + "\"><Points>" + float_array("p", positions, 3) +
         "</Points><Polys>" + float_array("connectivity", corners) + float_array("offsets", ends) +
         "</Polys><PointData>" + point_arrays + "</PointData><CellData>" + cell_arrays +
         "</CellData></Piece></PolyData></VTKFile>";
}

/// A square of two triangles, one per piece, that share the diagonal from (1, 0) to (0, 1), in a folder of its own.
/// z: of the shared corner (1, 0) in the second piece.
void put_square(const fs::path& folder, const std::string& name, const std::string& ids_a = "",
                const std::string& ids_b = "", const std::string& z = "0") {
  put(folder / (name + "_a.vtp"), piece(3, "0 0 0 1 0 0 0 1 0", 1, "0 1 2", ids_a, float_array("stress", "1")));
  put(folder / (name + "_b.vtp"),
      piece(3, "1 0 " + z + " 1 1 0 0 1 -0", 1, "0 1 2", ids_b, float_array("stress", "2")));
  put(folder / (name + ".pvtp"), naming({name + "_a.vtp", name + "_b.vtp"}));
}

grid::Grid triangle(const grid::GridState&) {
  grid::Grid grid;
  grid.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  grid.cells.add(grid::CellKind::triangle, std::array<std::uint32_t, 3>{0, 1, 2});
  return grid;
}

template <int count>
std::vector<fs::path> pieces(const fs::path& file) {
  std::vector<fs::path> names;
  for (int i = 0; i < count; ++i) names.push_back(file.string() + std::to_string(i));
  return names;
}
}  // namespace

TEST_CASE("points of different pieces are one node by their ids, or where their coordinates are equal") {
  const TemporaryFolder folder;
  put_square(folder.path(), "plain");
  put_square(folder.path(), "ids", float_array("NODE_ID", "7 8 9"), float_array("GlobalNodeId", "8 5 9"));
  put_square(folder.path(), "known", float_array("NODE_ID", "7 8 9"), float_array("NODE_ID", "8 5 9"), "0.000001");
  for (const char* name : {"plain.pvtp", "known.pvtp"}) {
    CAPTURE(name);
    const auto run = open_simulation(folder / name);
    CHECK(run->mesh().nodes() == 4);
    CHECK(run->mesh().elements.size() == 2);
    SimulationState state;
    run->read(0, state);
    CHECK(state.fields == std::vector<std::vector<float>>{{1, 2}});
    CHECK(run->files().size() == 1);
    CHECK(all_files(*run).size() == 3);
  }
  CHECK(open_simulation(folder / "known.pvtp")->mesh().node_ids == std::vector<std::uint32_t>{5, 7, 8, 9});
  check_error(refusal(folder / "ids.pvtp"), Status::bad_input, {"ids_b.vtp", "GlobalNodeId"});
  put_square(folder.path(), "local", float_array("NODE_ID", "1 2 3"), float_array("NODE_ID", "1 2 3"));
  check_error(refusal(folder / "local.pvtp"), Status::bad_input,
              {"local.pvtp: points 0 and 3", "the same node", "node ids of the whole mesh"});
}

TEST_CASE("points of one piece at one place stay different nodes") {
  const TemporaryFolder folder;
  put(folder / "a.vtp", piece(6, "0 0 0 1 0 0 0 1 0 0 0 0 1 0 0 0 1 0", 2, "0 1 2 3 4 5"));
  put(folder / "b.vtp", piece(3, "1 0 0 1 1 0 0 1 0", 1, "0 1 2"));
  put(folder / "run.pvtp", naming({"a.vtp", "b.vtp"}));
  CHECK(open_simulation(folder / "run.pvtp")->mesh().nodes() == 9);
}

TEST_CASE("VTK's own pieces without node ids: the same mesh") {
  const TemporaryFolder folder;
  for (const char* name : {"sample.pvtu", "sample_0.vtu", "sample_1.vtu"})
    put(folder / name,
        std::regex_replace(text_of(test::data() / "simulation" / "parts" / name), std::regex("NODE_ID"), "unused"));
  const auto run = open_simulation(folder.path());  // represents the pieces beside it
  CHECK(run->mesh().nodes() == 12);
  CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{7, 8, 9, 10, 11, 12});
  CHECK(run->time_s(0) == 2.5);
}

TEST_CASE("numbered parallel files and collections of them are runs; joined nodes stay joined") {
  const TemporaryFolder folder;
  put_square(folder.path(), "s_1");
  put_square(folder.path(), "s_2");
  put(folder / "s_2_a.vtp", piece(3, "0 0 3 1 0 0 0 1 0", 1, "0 1 2", "", float_array("stress", "1")));
  SimulationState state;
  for (const fs::path& given : {folder / "s_1.pvtp", folder.path()}) {
    const auto run = open_simulation(given);
    REQUIRE(run->states() == 2);
    run->read(1, state);
    CHECK(state.positions[2] == 3);
    CHECK(all_files(*run).size() == 6);
  }
  put(folder / "run.pvd",
      "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"s_1.pvtp\"/>"
      "<DataSet timestep=\"0.5\" file=\"s_2.pvtp\"/></Collection></VTKFile>");
  const auto run = open_simulation(folder.path());
  REQUIRE(run->states() == 2);
  CHECK(run->time_s(1) == 0.5);
  CHECK(all_files(*run).size() == 6);
  put_square(folder.path(), "s_2", "", "", "1");
  check_error(error_of([&] { open_simulation(folder.path())->read(1, state); }), Status::bad_input,
              {"s_2.pvtp: points 1 and 3", "the same node in", "s_1.pvtp"});
}

TEST_CASE("pieces may be empty, and give their time; cells of their neighbors are left out") {
  const TemporaryFolder folder;
  put(folder / "a.vtp", "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"0\"><Points>" +
                            float_array("p", "", 3) + "</Points></Piece></PolyData></VTKFile>");
  put(folder / "b.vtp", piece(4, "0 0 0 1 0 0 0 1 0 1 1 0", 2, "0 1 2 1 3 2", "",
                              float_array("vtkGhostLevels", "0 1") + float_array("stress", "4 5")));
  std::string timed = text_of(folder / "b.vtp");
  timed.insert(timed.find("<Piece"), "<FieldData>" + float_array("TimeValue", "3.5") + "</FieldData>");
  put(folder / "c.vtp", std::regex_replace(timed, std::regex("vtkGhostLevels"), "vtkGhostType"));
  put(folder / "run.pvtp", naming({"a.vtp", "b.vtp", "c.vtp"}));
  const auto run = open_simulation(folder / "run.pvtp");
  CHECK(run->mesh().elements.size() == 2);
  CHECK(run->fields().size() == 1);
  CHECK(run->time_s(0) == 3.5);
}

TEST_CASE("numbered parallel files have times of their own, or their pieces'; points with id 0 are not joined") {
  const TemporaryFolder folder;
  const std::string id = float_array("NODE_ID", "1 2 0");
  for (const std::string number : {"1", "2"}) {
    put(folder / ("p" + number + ".vtp"), piece(3, "0 0 0 1 0 0 0 1 0", 1, "0 1 2", id));
    put(folder / ("q" + number + ".vtp"), piece(3, "0 0 0 1 0 0 5 5 5", 1, "0 1 2", id));
    std::string text = naming({"p" + number + ".vtp", "q" + number + ".vtp"});
    text.insert(text.find("<Piece"), "<FieldData>" + float_array("TimeValue", "0." + number) + "</FieldData>");
    put(folder / ("run" + number + ".pvtp"), text);
  }
  check_error(refusal(folder / "run1.pvtp"), Status::bad_input, {"node id 0 belongs to two points"});
  for (const char* name : {"p1", "q1", "p2", "q2"})
    put(folder / (std::string(name) + ".vtp"),
        std::regex_replace(text_of(folder / (std::string(name) + ".vtp")), std::regex("1 2 0<"),
                           *name == 'p' ? "1 2 3<" : "1 2 4<"));
  const auto run = open_simulation(folder / "run1.pvtp");
  REQUIRE(run->states() == 2);
  CHECK(run->time_s(0) == 0.1);
  CHECK(run->time_s(1) == 0.2);
  CHECK(run->mesh().nodes() == 4);
}

TEST_CASE("the time to list pieces is proportional to their number") {
  const auto time_of = [](grid::ListParts list, std::size_t count) {
    const std::clock_t begin = std::clock();
    CHECK(grid::GridReader({{"run.pvtu", 0.0}}, triangle, nullptr, list).named_files().size() == count);
    return static_cast<double>(std::clock() - begin);
  };
  const double few = time_of(pieces<2'000>, 2'000);
  CHECK(time_of(pieces<16'000>, 16'000) < 25 * few);  // eight times as many; their square would be 64 times
}

TEST_CASE("what is wrong with parallel files is said") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, const std::vector<std::string>& words,
                           Status status = Status::bad_input) {
    CAPTURE(text);
    check_error(refusal(put(folder / "run.pvtp", text)), status, words);
  };
  refused(naming({}), {"run.pvtp names no pieces"});
  refused(naming({""}), {"piece 0 names no file"});
  refused(naming({"gone.vtp"}), {"run.pvtp: piece 0, gone.vtp", "copy it along"}, Status::file_not_found);
  refused(naming({"run.pvtp"}), {"holds a PPolyData"}, Status::unsupported_input);
  const auto timed = [](const std::string& time) {
    std::string text = naming({"a.vtp"});
    return text.insert(text.find("<Piece"), "<FieldData>" + float_array("TimeValue", time) + "</FieldData>");
  };
  put(folder / "a.vtp", piece(3, "0 0 0 1 0 0 0 1 0", 1, "0 1 2"));
  for (const char* time : {"0,5", "", "t"}) refused(timed(time), {"run.pvtp: its TimeValue", "is not a number"});
  refused(naming({"a"}).substr(0, 60), {"run.pvtp, byte", "XML"});
  refused("<VTKFile type=\"Table\"><!-- \"PPolyData\" --></VTKFile>", {"neither a PUnstructuredGrid"},
          Status::unsupported_input);
  put(folder / "a.vtp", piece(3, "0 0 0 1 0 0 0 1 0", 1, "0 1 2", "", float_array("stress", "1")));
  put(folder / "b.vtp", piece(3, "1 0 0 1 1 0 0 1 0", 1, "0 1 2"));
  refused(naming({"a.vtp", "b.vtp"}), {"b.vtp: has no array \"stress\""});
  refused(naming({"b.vtp", "a.vtp"}), {"a.vtp: its array \"stress\" is not that of the earlier pieces"});
  put(folder / "b.vtp", piece(3, "1 0 0 1 1 0 0 1 0", 1, "0 1 7"));
  refused(naming({"a.vtp", "b.vtp"}), {"b.vtp, cell 0: names point 7"});
}
