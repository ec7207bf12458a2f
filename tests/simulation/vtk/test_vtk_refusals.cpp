// What VTK files can say and what is wrong with them: a case per sentence, and a cell of every kind.
#include <doctest/doctest.h>

#include "adapters/simulation/open.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "tests/simulation/opening.hpp"
#include "tests/simulation/vtk/vtk_text.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

namespace fs = std::filesystem;

void refused(const std::string& text, const std::vector<std::string>& words, Status status = Status::bad_input) {
  check_refused("a.vtk", text, words, status);
}

/// `attributes` of VTKFile; {} in the pieces' place.
std::string xml(const std::string& pieces, const std::string& attributes = "type=\"PolyData\"",
                const std::string& element = "PolyData") {
  return "<VTKFile " + attributes + "><" + element + ">" + pieces + "</" + element + "></VTKFile>";
}
std::string polygons(const std::string& connectivity, const std::string& offsets, const std::string& arrays = "") {
  return "<Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points>" + float_array("p", "0 0 0 1 0 0 0 1 0", 3) +
         "</Points><Polys>" + connectivity + offsets + "</Polys><CellData>" + arrays + "</CellData></Piece>";
}
std::string replaced(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}
const std::string triangle_corners = data_array("connectivity", "Int64", "0 1 2"),
                  triangle_end = data_array("offsets", "Int64", "3");

}  // namespace

TEST_CASE("legacy files: what is wrong is said") {
  refused("# vtk DataFile Version 3.0\ntitle\nASKII\nDATASET POLYDATA\n", {"a.vtk, byte", "neither ASCII nor BINARY"});
  refused(legacy_head + "POINTS 3 float\n", {"which DATASET"});
  refused(legacy_head + "DATASET STRUCTURED_GRID\n", {"STRUCTURED_GRID is not read"}, Status::unsupported_input);
  refused(grid_head + "POINTS x float\n", {"expected a count"});
  for (const char* count : {"-3", "4294967296"})
    refused(grid_head + "POINTS " + count + " float\n", {"expected a count"});
  refused(grid_head + "POINTS 3\n0 0 0 1 0 0 0 1 0\n", {"a.vtk, byte"}, Status::unsupported_input);  // of no type
  refused(grid_head + "POINTS 3 quad\n0 0 0 1 0 0 0 1 0\n", {"quad"}, Status::unsupported_input);
  refused(grid_head + three_points + "SCALARS a float\n1 2 3\n", {"before POINT_DATA or CELL_DATA"});
  refused(grid_head + three_points + "POINT_DATA 3\nSCALARS a float 0\n", {"without components"});
  refused(grid_head + three_points + "FIELD FieldData 2\na 1 1 float\n7\n", {"before the last array of a FIELD"});
  refused(grid_head + "FIELD f 2\nnote 1 5 string\none\n", {"before the last array of a FIELD"});
  refused("# vtk DataFile Version 3.0\ntitle\nBINARY\nDATASET UNSTRUCTURED_GRID\nFIELD f 1\nnote 1 1 string\n\3one\n",
          {"type \"string\""}, Status::unsupported_input);
  refused(grid_head + "METADATA\nINFORMATION 0\n", {"no surface"}, Status::unsupported_input);
  refused(grid_head + three_points + "CELLS 2 4\n3 0 1 2\nCELL_TYPES 2\n5\n5\n",
          {"cells run past the end of their list"});
  refused(grid_head + three_points + "CELLS 2 6\n1 0\n3 0 1 2\nCELL_TYPES 2\n1\n21\n", {"no surface"},
          Status::unsupported_input);
  refused(grid_head + three_points + "CELLS 1 4\n3 0 1 2\n", {"as many CELL_TYPES as CELLS"});
  refused(grid_head + three_points + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n256\n", {"a cell type is too large"});
  refused(grid_head + three_points + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n20\n", {"cell 0", "VTK's kind 20"},
          Status::unsupported_input);
  refused(grid_head + three_points + "CELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n12\n",
          {"cell 0", "3 points, too few for cells of kind 12"});
  refused(grid_head + three_points + "CELLS 2 3\nOFFSETS vtktypeint64\n0 3\nCELLS\n", {"expected CONNECTIVITY"});
  refused(grid_head + three_points +
              "CELLS 3 3\nOFFSETS vtktypeint64\n0 3 1\nCONNECTIVITY vtktypeint64\n0 1 2\nCELL_TYPES 2\n5\n5\n",
          {"offsets of cells decrease"});
  refused(grid_head + three_points +
              "CELLS 2 3\nOFFSETS vtktypeint64\n0 4\nCONNECTIVITY vtktypeint64\n0 1 2\nCELL_TYPES 1\n5\n",
          {"offsets of cells decrease"});
  refused(grid_head + one_triangle + "POINT_DATA 2\nSCALARS a float\n1 2\n",
          {"array \"a\" has 2 values", "for 3 points"});
  refused(grid_head + one_triangle + "CELL_DATA 2\nSCALARS a float\n1 2\n",
          {"array \"a\" has 2 values", "for 1 cells"});
  refused(grid_head + "POINTS 2 float\n0 0 0 1 0 0\nCELLS 1 3\n2 0 1\nCELL_TYPES 1\n3\n", {"no surface"},
          Status::unsupported_input);
}

TEST_CASE("legacy files: every kind of attribute is read or passed over") {
  std::string sevens;
  for (int i = 0; i < 27; ++i) sevens += "7 ";
  const auto read = grid::parse_vtk_legacy(
      grid_head +
          "METADATA\nINFORMATION 0\n\nFIELD FieldData 3\nMETADATA\nCOMPONENT_NAMES\n\nTIME 1 1 double\n0.5\nnote 1 2 "
          "string\none\ntwo\nlist 2 1 int\n1 2\n" +
          one_triangle +
          "POINT_DATA 3\nVECTORS v%20w float\n1 2 3 4 5 6 7 8 9\nNORMALS n% float\n0 0 1 0 0 1 0 0 1\nTENSORS t "
          "float\n" +
          sevens +
          "\nTENSORS6 s float\n1 2 3 4 5 6 1 2 3 4 5 6 1 2 3 4 5 6\nGLOBAL_IDS g int\n5 6 7\nEDGE_FLAGS e int\n1 1 0\n"
          "CELL_DATA 1\nPEDIGREE_IDS p int\n9\nCOLOR_SCALARS c 3\n0.5 0.5 1\nTEXTURE_COORDINATES x 2 float\n0.25 "
          "0.75\nLOOKUP_TABLE l 2\n0 0 0 1 1 1 1 1\n"
          "SCALARS two float 2\nLOOKUP_TABLE l\n3 4\nSCALARS plain double\n1e-400\nFIELD more 2\nkept 1 1 "
          "float\n8\nother 1 5 float\n1 2 3 4 5\n",
      "all");
  CHECK(read.time == 0.5);
  CHECK(array_in(read.point_arrays, "v w").values == std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8, 9});
  CHECK(array_in(read.point_arrays, "n%").components == 3);
  CHECK(array_in(read.point_arrays, "t").values == std::vector<double>(27, 7));
  CHECK(array_in(read.point_arrays, "s").components == 6);
  CHECK(array_in(read.point_arrays, "g").values == std::vector<double>{5, 6, 7});
  CHECK(array_in(read.point_arrays, "e").values.back() == 0);
  CHECK(array_in(read.cell_arrays, "p").values.front() == 9);
  CHECK(array_in(read.cell_arrays, "c").values == std::vector<double>{0.5, 0.5, 1});
  CHECK(array_in(read.cell_arrays, "x").values == std::vector<double>{0.25, 0.75});
  CHECK(array_in(read.cell_arrays, "two").values == std::vector<double>{3, 4});
  CHECK(array_in(read.cell_arrays, "kept").values.front() == 8);
  CHECK(grid::find_array(read.cell_arrays, "other") == nullptr);  // of another length
}

TEST_CASE("polygons: vertices, lines, polygons and strips, numbered in this order wherever they stand") {
  const TemporaryFolder folder;
  const fs::path file =
      put(folder / "a.vtk",
          legacy_head +
              "DATASET POLYDATA\nPOINTS 5 float\n0 0 0 1 0 0 0 1 0 1 1 0 0 2 0\nTRIANGLE_STRIPS 1 6\n5 0 1 2 3 4\n"
              "POLYGONS 2 10\n3 0 1 2\n5 0 1 3 4 2\nLINES 1 3\n2 0 1\nVERTICES 1 2\n1 0\n"
              "CELL_DATA 5\nSCALARS plastic_strain float\n1 2 3 4 5\n");
  const auto run = open_simulation(file);
  REQUIRE(run->mesh().elements.size() == 1 + 3 + 3);
  CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{3, 4, 4, 4, 5, 5, 5});
  SimulationState state;
  run->read(0, state);
  CHECK(state.fields[0] == std::vector<float>{3, 4, 4, 4, 5, 5, 5});
  check_error(error_of([&] { run->read(1, state); }), Status::bad_input, {"has 1 states", "state 1"});
}

TEST_CASE("a cell of every kind gives the faces it has") {
  struct Kind {
    int number, points;
    std::size_t faces;
  };
  // VTK's numbers; flat cells count as one face, a strip of four points as two, a polygon of five as three.
  for (const Kind& kind : {Kind{5, 3, 1},
                           {22, 6, 1},
                           {9, 4, 1},
                           {8, 4, 1},
                           {23, 8, 1},
                           {28, 9, 1},
                           {7, 5, 3},
                           {7, 4, 1},
                           {6, 4, 2},
                           {10, 4, 4},
                           {24, 10, 4},
                           {11, 8, 6},
                           {12, 8, 6},
                           {25, 20, 6},
                           {29, 27, 6},
                           {13, 6, 5},
                           {26, 15, 5},
                           {14, 5, 5},
                           {27, 13, 5}}) {
    const int number = kind.number, points = kind.points;
    CAPTURE(number);
    std::string text = grid_head + "POINTS " + std::to_string(points) + " float\n", cell = std::to_string(points);
    for (int i = 0; i < points; ++i) {
      text += std::to_string(i * i) + " " + std::to_string(i) + " " + std::to_string(i * i * i % 7) + "\n";
      cell += " " + std::to_string(i);
    }
    text += "CELLS 2 " + std::to_string(points + 4) + "\n" + cell + "\n2 0 1\nCELL_TYPES 2\n" + std::to_string(number) +
            "\n3\n";
    const TemporaryFolder folder;
    const auto file = put(folder / "a.vtk", text);
    CHECK(open_simulation(file)->mesh().elements.size() == kind.faces);
    if (number == 6 || number == 7) continue;
    text.replace(text.find(cell), cell.size(),
                 std::to_string(points - 1) + cell.substr(cell.find(' '), cell.rfind(' ') - cell.find(' ')));
    text.replace(text.find("CELLS 2 "), 8 + std::to_string(points + 4).size(), "CELLS 2 " + std::to_string(points + 3));
    refused(text, {"too few for cells of kind " + std::to_string(number)});
  }
}

TEST_CASE("XML files: what is wrong is said") {
  refused("<?xml version=\"1.0\"?>\n<VTKFile", {"a.vtk, byte", "XML"});
  refused("<Other><!-- <VTKFile --></Other>", {"no element VTKFile"});
  refused(xml("", "type=\"ImageData\""), {"holds a ImageData"}, Status::unsupported_input);
  refused(xml("", "type=\"PImageData\""), {"give the pieces' own files"}, Status::unsupported_input);
  refused(xml("", "type=\"UnstructuredGrid\""), {"no element UnstructuredGrid"});
  refused(xml("", "type=\"PolyData\" compressor=\"vtkLZMADataCompressor\""), {"compressed with vtkLZMADataCompressor"},
          Status::unsupported_input);
  refused("<VTKFile type=\"PolyData\"><PolyData/><AppendedData encoding=\"raw\">", {"ends within its appended data"});
  refused(xml("<Piece NumberOfPoints=\"many\"/>"), {"no number at NumberOfPoints"});
  refused(xml("<Piece NumberOfPoints=\"4294967296\"/>"), {"no number at NumberOfPoints"});
  refused(xml("<Piece NumberOfPoints=\"3 points\"/>"), {"no number at NumberOfPoints"});
  refused(replaced(xml(polygons(triangle_corners, triangle_end)), "0 0 0 1 0 0 0 1 0", "0 0 0 1 0 0          \n"),
          {"fewer than 9 values"});
  refused(replaced(xml(polygons(triangle_corners, triangle_end)), "0 0 0 1 0", "0 0 1e999 1 0"),
          {"node 1", "not a number"});
  refused(xml(polygons(triangle_corners, triangle_end, data_array("a", "Float32", "", "NumberOfComponents=\"0\""))),
          {"array \"a\" has 0 values of 0 components"});
  refused(xml("<Piece NumberOfPoints=\"3\"/>"), {"a piece without points"});
  refused(xml("<Piece NumberOfPoints=\"1\"><Points>" + data_array("p", "Float128", "0 0 0") + "</Points></Piece>"),
          {"values of type Float128"}, Status::unsupported_input);
  refused(xml("<Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Float32\" format=\"appended\" "
              "offset=\"9\"/></Points></Piece>"),
          {"ends before the data"});
  refused(xml(polygons(triangle_corners, "")), {"no array \"offsets\" for its cells"});
  refused(xml(polygons("", triangle_end)), {"no array \"connectivity\" for its cells"});
  refused(xml(polygons(data_array("connectivity", "Int64", "0 -1 2"), triangle_end)),
          {"an index that is negative or too large"});
  refused(xml(polygons(data_array("connectivity", "Int64", "0 1"), triangle_end)), {"connectivity"});
  refused(xml(polygons(triangle_corners, triangle_end, data_array("a", "Float32", "1", "NumberOfComponents=\"x\""))),
          {"no number at NumberOfComponents"});
  refused(xml(polygons(triangle_corners, triangle_end, data_array("a", "Float32", "1")) +
              polygons(triangle_corners, triangle_end, data_array("a", "Float32", "1 2", "NumberOfComponents=\"2\""))),
          {"pieces with different arrays \"a\""});
  refused(xml(polygons(triangle_corners, triangle_end, data_array("a", "Float32", "1")) +
              polygons(triangle_corners, triangle_end)),
          {"array \"a\" has 1 values"});
  const auto unstructured = [](const std::string& offsets, const std::string& types) {
    return xml("<Piece NumberOfPoints=\"3\" NumberOfCells=\"2\"><Points>" +
                   data_array("p", "Float32", "0 0 0 1 0 0 0 1 0") + "</Points><Cells>" +
                   data_array("connectivity", "Int64", "0 1 2 0 1 2") + data_array("offsets", "Int64", offsets) +
                   data_array("types", "Int16", types) + "</Cells></Piece>",
               "type=\"UnstructuredGrid\"", "UnstructuredGrid");
  };
  refused(unstructured("3 6", "5 256"), {"a type of cell that does not exist"});
  refused(unstructured("3 2", "5 5"), {"decreasing offsets of cells"});
  refused(unstructured("7 6", "5 5"), {"decreasing offsets of cells"});
  refused(replaced(unstructured("3 2 6", "5 5 5"), "Cells=\"2\"", "Cells=\"3\""), {"decreasing offsets of cells"});
}

TEST_CASE("XML files in base64 and packed: blocks that do not fit are refused") {
  const auto with = [](const std::string& block, const std::string& compressor) {
    return xml("<Piece NumberOfPoints=\"1\"><Points><DataArray type=\"Float32\" Name=\"p\" format=\"binary\">" + block +
                   "</DataArray></Points></Piece>",
               "type=\"PolyData\" byte_order=\"LittleEndian\"" +
                   (compressor.empty() ? "" : " compressor=\"" + compressor + "\""));
  };
  for (const char* packed : {"vtkZLibDataCompressor", "vtkLZ4DataCompressor"}) {
    CAPTURE(packed);
    refused(with("", packed), {"its data end early"});
    refused(replaced(with("AAAAAA==", packed), "Points=\"1\"", "Points=\"0\""), {"no surface"},
            Status::unsupported_input);
    refused(replaced(with("AQAAAAAbtwAAAAAAAwAAAA==AAAA", packed), "Points=\"1\"", "Points=\"1000000\""),
            {"its declared size is too large for its compressed data"});
    refused(with("AAAAAAAAAAAAAAAA", packed), {"its size does not match its values"});  // no parts, but three values
    refused(with("AQAAAAwAAAAAAAAABAAAAA==AAAA", packed), {"its data end early"});  // four packed bytes, three there
    refused(with("AQAAAAwAAAAAAAAABAAAAA==AAAAAA==", packed),
            {"its data cannot be decompressed"});  // twelve bytes wanted
  }
  refused(with("AQAAAAwAAAAAAAAACwAAAA==eJxjYIAAAAAIAAE=", "vtkZLibDataCompressor"),
          {"its data cannot be decompressed"});  // to 8 bytes, not 12
  refused(with("DAAAAA==", ""), {"its data end early"});
  refused(with("CAAAAAAAAAAAAAAA", ""), {"array \"p\""});
}

TEST_CASE("collections: what is wrong is said") {
  const auto collection = [](const std::string& entries) {
    return "<VTKFile type=\"Collection\"><Collection>" + entries + "</Collection></VTKFile>";
  };
  refused(collection("").substr(0, 50), {"byte", "XML"});
  refused(collection(""), {"names no file"});
  refused(collection("<DataSet file=\"a.vtu\"/>"), {"a file without a time"});
  for (const std::string time : {"0,5", "t=1", "3 ms", "nan"})  // were read as 0, 0, 3
    refused(collection("<DataSet timestep=\"" + time + "\" file=\"a.vtu\"/>"),
            {"the time \"" + time + "\" of a.vtu is not a number"});
  refused(collection(
              "<DataSet timestep=\"1\" part=\"0\" file=\"a.vtu\"/><DataSet timestep=\"1\" part=\"1\" file=\"b.vtu\"/>"),
          {"several files at time 1.0"}, Status::unsupported_input);
  const TemporaryFolder folder;
  const fs::path file = put(folder / "part.vtp", xml(polygons(triangle_corners, triangle_end)));
  const fs::path pvd = put(folder.path() / "elsewhere" / "run.pvd",
                           collection("<DataSet timestep=\"2\" file=\"" + file.string() + "\"/>"));  // absolute
  CHECK(open_simulation(pvd)->time_s(0) == 2);
}

TEST_CASE("states of a series lack nothing that the first one has; displacements are told by their times") {
  const TemporaryFolder folder;
  SimulationState state;
  put(folder / "a1.vtk", grid_head + one_triangle + "CELL_DATA 1\nSCALARS stress float\nLOOKUP_TABLE default\n5\n");
  put(folder / "a2.vtk", grid_head + one_triangle);
  check_error(error_of([&] { open_simulation(folder / "a1.vtk")->read(1, state); }), Status::bad_input,
              {"a2.vtk", "no array \"stress\"", "a1.vtk"});
  put(folder / "a2.vtk", grid_head + one_triangle + "CELL_DATA 1\nSCALARS stress float\nLOOKUP_TABLE default\nnan\n");
  open_simulation(folder / "a1.vtk")->read(1, state);
  CHECK(std::isnan(state.fields[0][0]));  // what is no number stays none
  put(folder / "a2.vtk", grid_head +
                             "POINTS 3 float\n0 0 nan 1 0 0 0 1 0\nCELLS 1 4\n3 0 1 2\nCELL_TYPES 1\n5\nCELL_DATA "
                             "1\nSCALARS stress float\n1\n");
  check_error(error_of([&] { open_simulation(folder / "a1.vtk")->read(1, state); }), Status::bad_input,
              {"a2.vtk", "node 1", "not a number"});
  const fs::path file = put(
      folder.path() / "b" / "run.vtk",
      grid_head + one_triangle +
          "POINT_DATA 3\nVECTORS displacement_t0.5 float\n0 0 1 0 0 0 0 0 0\nVECTORS displacement_tx float\n"
          "0 0 0 0 0 0 0 0 0\nVECTORS displacement float\n0 0 0 0 0 0 0 0 0\nSCALARS displacement_t9 float\n0 0 0\n");
  const auto run = open_simulation(file);
  REQUIRE(run->states() == 1);
  CHECK(run->time_s(0) == 0.5);
}
