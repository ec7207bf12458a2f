// One grid in every encoding that VTK 9.1 itself writes: all of them are the same run.
#include <doctest/doctest.h>

#include <set>

#include "adapters/simulation/grid/grid.hpp"
#include "adapters/simulation/open.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "tests/support/files.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::test;

namespace {

namespace fs = std::filesystem;

fs::path encodings() { return data() / "simulation" / "encodings"; }

/// Alone in a folder: files in one folder whose names end in digits would be a series.
void check_sample(const fs::path& file) {
  const auto run = open_simulation(file);
  const SimulationMesh& mesh = run->mesh();
  REQUIRE(mesh.nodes() == 12);
  REQUIRE(mesh.elements.size() == 6);
  for (std::uint32_t node = 0; node < 12; ++node) {  // by id, which falls from 100 on in the file
    const std::uint32_t point = 11 - node;
    CHECK(mesh.node_ids[node] == 100 - point);
    CHECK(mesh.positions[3 * node] == static_cast<float>(point % 4));
    CHECK(mesh.positions[3 * node + 1] == static_cast<float>(point / 4));
    CHECK(mesh.positions[3 * node + 2] == doctest::Approx(0.1 * point));
  }
  REQUIRE(run->states() == 1);
  SimulationState state;
  run->read(0, state);
  CHECK(state.time_s == 2.5);
  REQUIRE(run->fields().size() == 1);
  CHECK(run->fields()[0].name == "plastic_strain");
  for (std::uint32_t e = 0; e < 6; ++e) {
    const std::uint32_t first = e / 3 * 4 + e % 3;  // point of the first corner
    CHECK(mesh.element_ids[e] == 7 + e);
    CHECK(mesh.element_parts[e] == 1 + e / 3);
    CHECK(mesh.elements[e][0] == 11 - first);
    CHECK((mesh.elements[e][2] == mesh.elements[e][3]) == (e % 3 == 2));
    CHECK(state.fields[0][e] == 0.125f * static_cast<float>(e));
    CHECK(state.alive[e] == 1);
  }
}

}  // namespace

TEST_CASE("every encoding that VTK writes is the same run") {
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(encodings())) files.insert(entry.path());
  CHECK(files.size() >= 27);
  for (const char* in_pieces : {"sample.pvtu", "sample.pvtp"})
    files.insert(data() / "simulation" / "parts" / in_pieces);
  for (const fs::path& file : files) {
    CAPTURE(file.filename().string());
    check_sample(file);
  }
}

TEST_CASE("a file cut anywhere is refused in words or is whole") {
  for (const auto& entry : fs::directory_iterator(encodings())) {
    CAPTURE(entry.path().filename().string());
    const std::string whole = text_of(entry.path());
    const bool is_xml = entry.path().extension() != ".vtk";
    std::size_t refused = 0;
    for (std::size_t length = 0; length < whole.size(); length += 7) {
      const Error error = error_of([&] {
        const auto cut = std::string_view(whole).substr(0, length);
        const grid::Grid read = is_xml ? grid::parse_vtk_xml(cut, "cut") : grid::parse_vtk_legacy(cut, "cut");
        grid::check_grid(read, "cut");
      });
      if (error.status == Status::ok) continue;
      CHECK(mentions(error, "cut"));
      ++refused;
    }
    CHECK(refused > whole.size() / 7 / 2);
  }
}

TEST_CASE("what VTK XML files may also be is refused in words") {
  const TemporaryFolder folder;
  const auto refused = [&](const std::string& text, Status status, const std::vector<std::string>& words) {
    const fs::path file = put(folder / "a.vtu", text);
    check_error(error_of([&] { static_cast<void>(open_simulation(file)); }), status, words);
  };
  refused("<VTKFile type=\"ImageData\"><ImageData/></VTKFile>", Status::unsupported_input, {"a.vtu", "ImageData"});
  refused("<VTKFile type=\"PImageData\"></VTKFile>", Status::unsupported_input, {"PImageData", "pieces"});
  refused("<VTKFile type=\"UnstructuredGrid\" compressor=\"vtkLZMADataCompressor\"></VTKFile>",
          Status::unsupported_input, {"vtkLZMADataCompressor", "ZLib"});
  refused("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid>", Status::bad_input, {"a.vtu", "byte"});
  refused(
      "<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid><Piece NumberOfPoints=\"4000000000\"><Points><DataArray "
      "type=\"Float32\" format=\"ascii\">1 2</DataArray></Points></Piece></UnstructuredGrid></VTKFile>",
      Status::bad_input, {"fewer than"});
  refused("<VTKFile type=\"UnstructuredGrid\"><UnstructuredGrid/></VTKFile>", Status::unsupported_input,
          {"no surface"});
}
