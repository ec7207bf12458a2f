// Series of VTK files as runs: numbered files, ParaView's collections, displacements in one file.
#include <doctest/doctest.h>

#include "adapters/export/vtu.hpp"
#include "adapters/simulation/open.hpp"
#include "tests/simulation/vtk/vtk_text.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

namespace fs = std::filesystem;

/// As OpenRadioss's converter writes it: two shells whose nodes stand in another order than their ids, the wall's
/// drawing behind them with ids 0, and one of the shells eroded.
std::string state(const std::string& time, const std::string& z, const std::string& alive = "1",
                  const std::string& id = "3") {
  return "# vtk DataFile Version 3.0\nvtk output\nASCII\nDATASET UNSTRUCTURED_GRID\nFIELD FieldData 2\nTIME 1 1 "
         "double\n" +
         time + "\nCYCLE 1 1 int\n0\nPOINTS 8 float\n1 0 0\n0 0 0\n0 1 0\n1 1 " + z +
         "\n2 0 0\n2 1 0\n9 9 9\n9 9 9\n\nCELLS 4 19\n4 1 0 3 2\n3 0 4 5\n4 7 7 7 7\n4 6 7 7 6\n\nCELL_TYPES "
         "4\n9\n5\n9\n9\n\n"
         "POINT_DATA 8\nSCALARS NODE_ID int 1\nLOOKUP_TABLE default\n2\n1\n4\n3\n5\n6\n0\n0\n\n"
         "CELL_DATA 4\nSCALARS ELEMENT_ID int 1\nLOOKUP_TABLE default\n8\n" +
         id +
         "\n0\n0\nSCALARS PART_ID int 1\n"
         "LOOKUP_TABLE default\n1\n2\n1\n1\nSCALARS EROSION_STATUS int 1\nLOOKUP_TABLE default\n1\n" +
         alive +
         "\n1\n1\nSCALARS 2DELEM_Plastic_Strain float 1\nLOOKUP_TABLE default\n0.25\n0.5\n0\n0\n"
         "SCALARS 3DELEM_Plastic_Strain float 1\nLOOKUP_TABLE default\n7\n7\n7\n7\n";
}

std::string grid_xml(const std::string& z, const std::string& point_data) {
  return "<VTKFile type=\"PolyData\"><PolyData><Piece NumberOfPoints=\"3\" NumberOfPolys=\"1\"><Points><DataArray "
         "type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 " +
         z +
         " 1 0 0 0 1 0</DataArray></Points><Polys>"
         "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">0 1 2</DataArray><DataArray type=\"Int64\" "
         "Name=\"offsets\" format=\"ascii\">3</DataArray></Polys><PointData>" +
         point_data + "</PointData></Piece></PolyData></VTKFile>";
}

}  // namespace

TEST_CASE("a series as the solver's converter writes it: by ids, without the wall's drawing, eroded elements known") {
  const TemporaryFolder folder;
  put(folder / "A001.vtk", state("0", "0"));
  put(folder / "A10.vtk", state("2.5", "-7", "0"));  // by number, not by name
  put(folder / "A2.vtk", state("1.5", "5"));
  for (const fs::path& given : {folder.path(), folder / "A10.vtk"}) {
    const auto run = open_simulation(given);
    CHECK(run->mesh().node_ids == std::vector<std::uint32_t>{1, 2, 3, 4, 5, 6});
    CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{3, 8});
    CHECK(run->mesh().element_parts == std::vector<std::uint32_t>{2, 1});
    CHECK(run->mesh().elements[0] == std::array<std::uint32_t, 4>{1, 4, 5, 5});
    CHECK(run->mesh().elements[1] == std::array<std::uint32_t, 4>{0, 1, 2, 3});
    REQUIRE(run->states() == 3);
    CHECK(run->files().back() == folder / "A10.vtk");
    SimulationState read;
    run->read(2, read);
    CHECK(read.time_s == 2.5);
    CHECK(read.positions[3 * 2 + 2] == -7);
    CHECK(read.alive == std::vector<std::uint8_t>{0, 1});
    CHECK(read.fields == std::vector<std::vector<float>>{{0.5f, 0.25f}});
    run->read(1, read);
    CHECK(read.time_s == 1.5);
    CHECK(read.positions[3 * 2 + 2] == 5);
    CHECK(read.alive == std::vector<std::uint8_t>{1, 1});
  }
}

TEST_CASE("states that do not belong together are refused by name and number") {
  const TemporaryFolder folder;
  put(folder / "A1.vtk", state("0", "0"));
  const auto second = [&](const std::string& text) {
    put(folder / "A2.vtk", text);
    return error_of([&] {
      const auto run = open_simulation(folder / "A1.vtk");
      SimulationState read;
      run->read(1, read);
    });
  };
  check_error(second(state("1", "0", "1", "4")), Status::bad_input, {"A2.vtk", "A1.vtk", "8 points and 4 cells"});
  check_error(second(state("-1", "0")), Status::bad_input, {"A2.vtk", "time"});
  check_error(
      second("# vtk DataFile Version 3.0\n\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n0 0 0 1 0 0 0 1 0\nPOLYGONS 1 4\n"
             "3 0 1 2\n"),
      Status::bad_input, {"A2.vtk", "time"});
  check_error(second("nothing"), Status::bad_input, {"A2.vtk", "byte"});
  put(folder / "B1.vtk", state("0", "0"));
  check_error(error_of([&] { static_cast<void>(open_simulation(folder.path())); }), Status::bad_input,
              {"more than one run", "A1.vtk", "B1.vtk"});
}

TEST_CASE("damage in a legacy file is refused with the byte") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& from, const std::string& to, const std::vector<std::string>& words) {
    std::string text = state("0", "0");
    text.replace(text.find(from), from.size(), to);
    const fs::path file = put(folder / "a.vtk", text);
    check_error(error_of([&] { static_cast<void>(open_simulation(file)); }), Status::bad_input, words);
  };
  refused("CELLS 4 19\n4 1", "CELLS 4 19\n9999 1", {"a.vtk", "byte", "past the end"});
  refused("4 1 0 3 2", "4 1 0 3 8", {"cell 0", "point 8"});
  refused("POINTS 8 float", "POINTS 4000000000 float", {"too few values"});
  refused("SCALARS NODE_ID int 1", "SCALARS NODE_ID int 99999999999999999999", {"count"});
  refused("default\n2\n1\n4", "default\n2\n1\n2", {"node id 2", "two points"});
  refused("default\n2\n1\n4", "default\n2.5\n1\n2", {"NODE_ID", "not an id"});
  refused("SCALARS PART_ID", "SCALERS PART_ID", {"unknown keyword"});
}

TEST_CASE("a collection names files and their times") {
  const TemporaryFolder folder;
  put(folder.path() / "data" / "b.vtp", grid_xml("5", ""));
  put(folder.path() / "data" / "a.vtp", grid_xml("0", ""));
  put(folder / "run.pvd",
      "<?xml version=\"1.0\"?><VTKFile type=\"Collection\"><Collection>"
      "<DataSet timestep=\"0.5\" file=\"data/b.vtp\"/><DataSet timestep=\"0.25\" file=\"data/a.vtp\"/>"
      "</Collection></VTKFile>");
  const auto run = open_simulation(folder.path());
  REQUIRE(run->states() == 2);
  SimulationState state;
  run->read(1, state);
  CHECK(state.time_s == 0.5);
  CHECK(state.positions[2] == 5);
  CHECK(run->time_s(0) == 0.25);
  put(folder / "run.pvd",
      "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0\" file=\"gone.vtu\"/></Collection></VTKFile>");
  check_error(error_of([&] { static_cast<void>(open_simulation(folder / "run.pvd")); }), Status::file_not_found,
              {"gone.vtu"});
}

TEST_CASE("a collection with an entry that names no file is refused by its own name") {
  const TemporaryFolder folder;
  put(folder / "run.pvd",
      "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"0.5\" file=\"\"/></Collection></VTKFile>");
  check_error(error_of([&] { static_cast<void>(open_simulation(folder / "run.pvd")); }), Status::bad_input,
              {"run.pvd: the entry at time 0.5 names no file"});
}

TEST_CASE("what this project exports it reads: numbered VTU files with ids and times") {
  const TemporaryFolder folder;
  const std::vector<std::uint32_t> corners{0, 1, 3, 2, 1, 4, 3, 3}, node_ids{10, 20, 30, 40, 50}, element_ids{6, 5},
      parts{1, 2};
  for (const double time : {1.0, 2.0}) {
    const auto z = static_cast<float>(time);
    const std::vector<float> positions{0, 0, z, 1, 0, 0, 0, 1, 0, 1, 1, 0, 2, 0, 0}, strain{0.5f * z, z};
    VtuGrid grid;
    grid.positions = positions;
    grid.element_nodes = corners;
    grid.time_s = time;
    grid.point_arrays.push_back({"node_id", std::span<const std::uint32_t>(node_ids), 1});
    grid.cell_arrays.push_back({"element_id", std::span<const std::uint32_t>(element_ids), 1});
    grid.cell_arrays.push_back({"part", std::span<const std::uint32_t>(parts), 1});
    grid.cell_arrays.push_back({"plastic_strain", std::span<const float>(strain), 1});
    write_vtu(folder / ("mesh_" + std::to_string(static_cast<int>(time)) + ".vtu"), grid);
  }
  const auto run = open_simulation(folder.path());
  CHECK(run->mesh().node_ids == node_ids);
  CHECK(run->mesh().element_ids == std::vector<std::uint32_t>{5, 6});
  CHECK(run->mesh().element_parts == std::vector<std::uint32_t>{2, 1});
  CHECK(run->mesh().elements[0] == std::array<std::uint32_t, 4>{1, 4, 3, 3});
  REQUIRE(run->states() == 2);
  CHECK(run->time_s(1) == 2);
  SimulationState state;
  run->read(1, state);
  CHECK(state.positions[2] == 2);
  CHECK(state.fields == std::vector<std::vector<float>>{{2, 1}});
}

TEST_CASE("displacements in one file are a run") {
  const TemporaryFolder folder;
  const fs::path file =
      put(folder / "run.vtp",
          grid_xml("0", float_array("displacement_t0.005", "0 0 -3 0 0 0 0 0 0", 3) +
                            float_array("displacement_t0.000", "0 0 0 0 0 0 0 0 0", 3) +
                            float_array("plastic_strain_t0.000", "0 0 0") +
                            float_array("plastic_strain_t0.005", "0.1 0.2 0.6") + float_array("mass", "1 1 1")));
  const auto run = open_simulation(file);
  REQUIRE(run->states() == 2);
  REQUIRE(run->fields().size() == 1);
  CHECK(run->fields()[0].name == "plastic_strain");
  SimulationState state;
  run->read(1, state);
  CHECK(state.time_s == 0.005);
  CHECK(state.positions[2] == -3);
  CHECK(state.fields[0][0] == doctest::Approx(0.3));  // the mean of the corners
  run->read(0, state);
  CHECK(state.positions[2] == 0);
  CHECK(state.fields[0][0] == 0);
}

TEST_CASE("a numbered file with displacements is a run of its own, not a state of a series") {
  const TemporaryFolder folder;
  const auto text = [](const std::string& z) {
    return grid_xml("0", float_array("displacement_t0.0", "0 0 0 0 0 0 0 0 0", 3) +
                             float_array("displacement_t0.5", "0 0 " + z + " 0 0 0 0 0 0", 3));
  };
  put(folder / "run_1.vtp", text("1"));
  put(folder / "run_2.vtp", text("2"));
  for (const int number : {1, 2}) {
    const fs::path file = folder / ("run_" + std::to_string(number) + ".vtp");
    const auto run = open_simulation(file);
    REQUIRE(run->states() == 2);
    CHECK(run->files() == std::vector<fs::path>{file});
    SimulationState read;
    run->read(1, read);
    CHECK(read.positions[2] == static_cast<float>(number));
  }
  check_error(error_of([&] { static_cast<void>(open_simulation(folder.path())); }), Status::bad_input,
              {"run_1.vtp holds a whole run", "run_2.vtp", "give one of these files"});
}

TEST_CASE("displacements beside points that do not move are reported") {
  const TemporaryFolder folder;
  const auto write = [&](const std::string& name, const std::string& z, const std::string& vector) {
    put(folder / (name + "_0.vtp"), grid_xml("0", float_array(vector, "0 0 0 0 0 0 0 0 0", 3)));
    put(folder / (name + "_1.vtp"), grid_xml(z, float_array(vector, "0 0 7 0 0 0 0 0 0", 3)));
    const auto run = open_simulation(folder / (name + "_0.vtp"));
    SimulationState read;
    for (std::uint32_t state : {0u, 1u}) run->read(state, read);
    return run->remark();
  };
  CHECK(contains(write("still", "0", "Displacement"), "the points do not move, and the vector 'Displacement' is not"));
  CHECK(contains(write("still", "0", "U"), "'U' is not used; export deformed positions"));
  CHECK(write("still", "0", "velocity").empty());
  CHECK(write("moving", "7", "displacement").empty());
}

TEST_CASE("a missing number in a series without times shifted the later states") {
  const TemporaryFolder folder;
  const auto states = [&](const std::vector<int>& numbers) {
    const fs::path place = folder / "series";
    fs::remove_all(place);
    for (const int number : numbers) put(place / ("s_" + std::to_string(number) + ".vtp"), grid_xml("0", ""));
    return open_simulation(place)->states();
  };
  CHECK(states({0, 1, 2, 3}) == 4);
  CHECK(states({0, 10, 20, 30, 33}) == 5);          // a shorter last step
  CHECK(states({0, 1032, 2051, 3099, 4120}) == 5);  // cycles of a solver
  CHECK(states({0, 1, 1000, 2000, 3000}) == 5);     // two of them in succession
  CHECK(states({0, 1000, 2003}) == 3);
  CHECK(states({0, 1000, 2000, 3005}) == 4);
  CHECK(states({3, 7}) == 2);
  check_error(error_of([&] {
                states({0, 1, 2, 5, 6});
              }),
              Status::bad_input, {"s_5.vtp follows s_2.vtp, number 3 is missing"});
  check_error(error_of([&] { states({0, 10, 20, 40}); }), Status::bad_input, {"number 30 is missing"});
}

TEST_CASE("states that lack the flags of eroded elements, or hold other flags than numbers, are refused") {
  const TemporaryFolder folder;
  const auto without = [](std::string text) {
    const std::size_t from = text.find("SCALARS EROSION_STATUS");
    return text.erase(from, text.find("SCALARS 2DELEM") - from);
  };
  const auto refusal = [&](const std::string& first, const std::string& second) {
    put(folder / "A1.vtk", first);
    put(folder / "A2.vtk", second);
    return error_of([&] {
      const auto run = open_simulation(folder / "A1.vtk");
      SimulationState read;
      run->read(1, read);
    });
  };
  check_error(refusal(state("0", "0"), without(state("1", "0", "0"))), Status::bad_input,
              {"A2.vtk: has no array", "EROSION_STATUS", "A1.vtk has"});
  std::string nan = state("1", "0", "nan");
  nan.replace(nan.find("EROSION_STATUS int"), 18, "EROSION_STATUS float");
  check_error(refusal(state("0", "0"), nan), Status::bad_input,
              {"A2.vtk: \"EROSION_STATUS\" of element 3 is not a number"});
}

TEST_CASE("nodes of elements that are eroded in the first state have no undeformed place, and may have no number") {
  const TemporaryFolder folder;
  const auto without_place = [](std::string text) {
    const std::string point = "\n2 0 0\n";
    return text.replace(text.find(point), point.size(), "\nnan inf 1e30\n");
  };
  put(folder / "A1.vtk", without_place(state("0", "0", "0")));
  put(folder / "A2.vtk", without_place(state("1", "0", "0")));
  const auto run = open_simulation(folder / "A1.vtk");
  const SimulationMesh& mesh = run->mesh();
  REQUIRE(mesh.guessed.size() == mesh.nodes());
  for (std::size_t node = 0; node < mesh.nodes(); ++node) {
    const bool is_free = mesh.node_ids[node] == 5 || mesh.node_ids[node] == 6;
    CHECK((mesh.guessed[node] != 0) == is_free);
    if (is_free)  // the only neighbor with a place
      CHECK(std::vector(&mesh.positions[3 * node], &mesh.positions[3 * node] + 3) == std::vector{1.0f, 0.0f, 0.0f});
  }
  SimulationState read;
  for (const std::uint32_t step : {0u, 1u}) CHECK_NOTHROW(run->read(step, read));
  put(folder / "A2.vtk", without_place(state("1", "nan", "0")));
  check_error(error_of([&] { open_simulation(folder / "A1.vtk")->read(1, read); }), Status::bad_input,
              {"A2.vtk: node 3 has a position that is not a number"});
  put(folder / "A1.vtk", without_place(state("0", "0")));
  check_error(error_of([&] { (void)open_simulation(folder / "A1.vtk"); }), Status::bad_input,
              {"A1.vtk: node 5 has a position that is not a number"});
  put(folder / "A1.vtk", state("0", "0"));
  CHECK(open_simulation(folder / "A1.vtk")->mesh().guessed.empty());
}
