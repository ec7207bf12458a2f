// VTK files that are right and yet unlike those that VTK writes: line ends, names, arrays that are there twice or hold
// nothing.
#include <doctest/doctest.h>

#include "adapters/simulation/open.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "tests/simulation/vtk/vtk_text.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <bit>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

namespace fs = std::filesystem;

const std::string polygon_head = legacy_head + "DATASET POLYDATA\n";
const std::string triangle_file = grid_head + one_triangle;
const std::vector<float> triangle_positions{0, 0, 0, 1, 0, 0, 0, 1, 0};

/// The values of a file's only field in its first state.
std::vector<float> only_field(const fs::path& file) {
  const auto run = open_simulation(file);
  REQUIRE(run->fields().size() == 1);
  SimulationState state;
  run->read(0, state);
  return state.fields[0];
}

/// Big-endian, as binary legacy files are.
template <class T>
std::string stored(T value) {
  const auto bits = std::bit_cast<std::uint32_t>(value);
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(bits >> shift);
  return bytes;
}

}  // namespace

TEST_CASE("line ends of Windows and tabs") {
  const TemporaryFolder folder;
  std::string windows;
  for (const char c : triangle_file + "CELL_DATA 1\nSCALARS stress float\nLOOKUP_TABLE default\n5\n")
    windows += c == '\n' ? "\r\n" : std::string(1, c);
  windows.replace(windows.find("0 0 0 1"), 7, "0\t0\t 0\t\t1");
  const auto run = open_simulation(put(folder / "a.vtk", windows));
  CHECK(run->mesh().positions == triangle_positions);
  CHECK(only_field(folder / "a.vtk") == std::vector<float>{5});
  const auto xml = grid::parse_vtk_xml(
      "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"3\"><Points><DataArray type=\"Float32\" "
      "format=\"ascii\">\r\n"
      "\t0\t0 0\r\n1 0 0&#13;&#10;0 1 0\r\n</DataArray></Points></Piece></PolyData></VTKFile>",
      "a.vtp");
  CHECK(xml.positions == triangle_positions);
}

TEST_CASE("names of the time, names that only look encoded, arrays of nothing, kinds of polygons") {
  for (const std::string name : {"TIME", "TimeValue", "Time"})
    CHECK(grid::parse_vtk_legacy(polygon_head + "FIELD FieldData 1\n" + name + " 1 1 double\n0.5\n", "t").time == 0.5);
  const auto read = grid::parse_vtk_legacy(
      polygon_head + "FIELD FieldData 2\nmixed 1 2 variant\nx\ny\nhollow 0 3 float\n" + three_points +
          "POLYGONS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\nPOINT_DATA 3\nSCALARS n%zz float\n1 2 3\nFIELD more 1\nhollow 0 3 "
          "float\n",
      "t");
  CHECK(array_in(read.point_arrays, "n%zz").values == std::vector<double>{1, 2, 3});
  CHECK(read.point_arrays.size() == 1);
  REQUIRE(read.cells.size() == 1);
  CHECK(read.cells.kinds[0] == grid::CellKind::polygon);
}

TEST_CASE("binary legacy files: colours and their tables are bytes") {
  std::string text = "# vtk DataFile Version 3.0\ntitle\nBINARY\nDATASET POLYDATA\nPOINTS 3 float\n";
  for (const float value : triangle_positions) text += stored(value);
  text += "\nPOLYGONS 1 4\n";
  for (const std::uint32_t value : {3u, 0u, 1u, 2u}) text += stored(value);
  text += "\nCELL_DATA 1\nCOLOR_SCALARS c 3\n\xff" + std::string(1, '\0') +
          "\x80\nLOOKUP_TABLE l 2\nabcdefgh\nSCALARS stress float\nLOOKUP_TABLE l\n" + stored(2.5f) + "\n";
  const auto read = grid::parse_vtk_legacy(text, "b");
  CHECK(read.positions == triangle_positions);
  CHECK(array_in(read.cell_arrays, "c").values == std::vector<double>{255, 0, 128});
  CHECK(array_in(read.cell_arrays, "stress").values == std::vector<double>{2.5});
}

TEST_CASE("a field at cells goes before one of the same name at points; solids have their own") {
  const TemporaryFolder folder;
  const std::string at_points = "SCALARS stress float\nLOOKUP_TABLE default\n1 2 3";
  CHECK(only_field(put(folder / "a.vtk", triangle_file + "POINT_DATA 3\n" + at_points +
                                             "\nCELL_DATA 1\nSCALARS stress float\nLOOKUP_TABLE default\n5\n")) ==
        std::vector<float>{5});
  CHECK(only_field(put(folder / "b.vtk", triangle_file + "POINT_DATA 3\n" + at_points + "\n")) ==
        std::vector<float>{2});  // their mean
  const std::string solid = grid_head +
                            "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 "
                            "3\nCELL_TYPES 1\n10\nPOINT_DATA 4\n" +
                            at_points + " 4\nCELL_DATA 1\nSCALARS 3DELEM_stress float\nLOOKUP_TABLE default\n7\n";
  CHECK(only_field(put(folder / "c.vtk", solid)) == std::vector<float>{7, 7, 7, 7});
}

TEST_CASE("vectors are neither ids nor displacements, unless they say so") {
  const TemporaryFolder folder;
  const std::string vector = " float\n0 0 9 0 0 9 0 0 9\n";
  const auto run = open_simulation(put(folder / "a.vtk", triangle_file + "POINT_DATA 3\nVECTORS velocity" + vector +
                                                             "VECTORS NODE_ID" + vector + "VECTORS displacement_t1s" +
                                                             vector + "VECTORS displacement_tinf" + vector));
  CHECK(run->states() == 1);
  CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{1, 2, 3});
  CHECK(run->mesh().positions == triangle_positions);
}

TEST_CASE("states of a series keep their points and their arrays' width") {
  const TemporaryFolder folder;
  SimulationState state;
  const auto second = [&](const std::string& text) {
    put(folder / "a1.vtk", triangle_file + "CELL_DATA 1\nSCALARS stress float\nLOOKUP_TABLE default\n5\n");
    put(folder / "a2.vtk", text);
    return error_of([&] { open_simulation(folder / "a1.vtk")->read(1, state); });
  };
  check_error(second(triangle_file + "CELL_DATA 1\nVECTORS stress float\n1 2 3\n"), Status::bad_input,
              {"a2.vtk", "no array \"stress\""});
  const std::string wider =
      grid_head + "POINTS 4 float\n0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\n";
  check_error(second(wider), Status::bad_input, {"a2.vtk", "4 points and 1 cells", "3 points and 1 cells"});
}
