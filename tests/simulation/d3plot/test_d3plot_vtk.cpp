// The same run as the solver's own converter writes it in text: positions, connectivity and plastic strain by id.
#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <map>
#include <set>

#include "adapters/simulation/open.hpp"
#include "tests/support/test_data.hpp"

namespace fs = std::filesystem;

namespace {

struct TextState {
  double time_ms = 0;
  std::vector<std::array<double, 3>> points;
  std::vector<std::vector<std::size_t>> cells;
  std::map<std::string, std::vector<double>> scalars;
};

TextState read_text(const fs::path& file) {
  std::ifstream in(file);
  TextState state;
  std::string word, name;
  std::size_t rows = 0;
  while (in >> word) {
    if (word == "TIME") {
      in >> word >> word >> word >> state.time_ms;
    } else if (word == "POINTS") {
      in >> rows >> word;
      state.points.resize(rows);
      for (auto& point : state.points) in >> point[0] >> point[1] >> point[2];
    } else if (word == "CELLS") {
      in >> rows >> word;
      state.cells.resize(rows);
      for (auto& cell : state.cells) {
        std::size_t corners = 0;
        in >> corners;
        cell.resize(corners);
        for (std::size_t& corner : cell) in >> corner;
      }
    } else if (word == "POINT_DATA" || word == "CELL_DATA") {
      in >> rows;
    } else if (word == "SCALARS") {
      in >> name >> word >> word >> word >> word;
      state.scalars[name].resize(rows);
      for (double& value : state.scalars[name]) in >> value;
    }
  }
  return state;
}

/// Row by id; the drawing of the wall has ids that the run does not.
std::map<std::uint32_t, std::size_t> by_id(const std::vector<double>& ids) {
  std::map<std::uint32_t, std::size_t> rows;
  for (std::size_t i = 0; i < ids.size(); ++i) rows[static_cast<std::uint32_t>(ids[i])] = i;
  return rows;
}

/// The text has six significant digits; plastic strain and positions were single precision before.
bool agrees(float value, double text) { return std::abs(value - text) <= 5.1e-6 * std::abs(text) + 1e-30; }

void check_positions(const lbea::bake::SimulationMesh& mesh, const std::vector<float>& positions,
                     const TextState& text) {
  const auto rows = by_id(text.scalars.at("NODE_ID"));
  std::size_t differing = 0;
  for (std::size_t n = 0; n < mesh.nodes(); ++n)
    for (std::size_t axis = 0; axis < 3; ++axis)
      if (!agrees(positions[3 * n + axis], text.points[rows.at(mesh.node_ids[n])][axis])) ++differing;
  CHECK(differing == 0);
}

void check_elements(const lbea::bake::SimulationMesh& mesh, const std::vector<float>& plastic_strain,
                    const TextState& text) {
  const auto rows = by_id(text.scalars.at("ELEMENT_ID"));
  const auto& node_ids = text.scalars.at("NODE_ID");
  std::size_t differing = 0;
  for (std::size_t e = 0; e < mesh.elements.size(); ++e) {
    const std::size_t cell = rows.at(mesh.element_ids[e]);
    std::set<std::uint32_t> here, there;
    for (const std::uint32_t node : mesh.elements[e]) here.insert(mesh.node_ids[node]);
    for (const std::size_t point : text.cells[cell]) there.insert(static_cast<std::uint32_t>(node_ids[point]));
    const bool same = here == there && text.scalars.at("PART_ID")[cell] == mesh.element_parts[e] &&
                      agrees(plastic_strain[e], text.scalars.at("2DELEM_Plastic_Strain")[cell]);
    if (!same) ++differing;
  }
  CHECK(differing == 0);
}

}  // namespace

TEST_CASE("a run as d3plot is the run as text") {
  const fs::path vtk = lbea::test::reference_data() / "vtk";
  const auto run = lbea::io::open_simulation(vtk / "run_004_d3plot");
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(vtk / "run_004")) files.insert(entry.path());
  REQUIRE(run->states() == files.size());
  REQUIRE(run->fields().size() == 1);
  lbea::bake::SimulationState state;
  std::uint32_t s = 0;
  for (const auto& file : files) {
    CAPTURE(file.string());
    const TextState text = read_text(file);
    run->read(s++, state);
    CHECK(state.time_s * 1000 == doctest::Approx(text.time_ms).epsilon(1e-5));
    check_positions(run->mesh(), state.positions, text);
    check_elements(run->mesh(), state.fields[0], text);
  }
}
