// One grid in every encoding that VTK 9.1 itself writes: all of them are the same run.
#include <doctest/doctest.h>

#include <set>

#include "adapters/simulation/grid/grid.hpp"
#include "adapters/simulation/open.hpp"
#include "adapters/simulation/vtk/vtk.hpp"
#include "tests/simulation/sample_grid.hpp"
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

}  // namespace

TEST_CASE("every encoding that VTK writes is the same run") {
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(encodings())) files.insert(entry.path());
  CHECK(files.size() >= 27);
  for (const char* in_pieces : {"sample.pvtu", "sample.pvtp"})
    files.insert(data() / "simulation" / "parts" / in_pieces);
  for (const fs::path& file : files) {
    CAPTURE(file.filename().string());
    check_sample_grid(file);
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
