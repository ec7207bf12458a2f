// A run whose states are mesh files, or displacements in one mesh file, as a SimulationReader.
#pragma once

#include <optional>
#include <vector>

#include "adapters/simulation/grid/grid_mesh.hpp"

namespace lbea::io::grid {

struct GridState {
  std::filesystem::path file;
  std::optional<double> time;  // without: the file's own, else the number of the state
};

/// Files must have the same cells, and ids where they have any; positions and values may differ. A file with point
/// arrays displacement_t<time> is a run by itself: a state per array, values in arrays that end likewise.
class GridReader final : public bake::SimulationReader {
 public:
  /// Reads the first file whole and, where `states` gives no times, every other one's time by `read_time`.
  GridReader(std::vector<GridState> states, ReadGrid read_grid, ReadGrid read_time);

  [[nodiscard]] const bake::SimulationMesh& mesh() const noexcept override { return sourced_.mesh; }
  [[nodiscard]] const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  [[nodiscard]] std::uint32_t states() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return place(state).time; }
  void read(std::uint32_t state, bake::SimulationState& into) override;
  [[nodiscard]] std::vector<std::filesystem::path> files() const override { return files_; }

 private:
  struct Place {
    std::size_t file = 0;
    double time = 0;
    std::string suffix;  // of the arrays of this state in a file that holds them all
  };
  [[nodiscard]] const Place& place(std::uint32_t state) const;
  void find_displacements(const Grid& grid);
  void find_times(const std::vector<GridState>& states, const Grid& first, ReadGrid read_time);
  void load(std::size_t file);
  void check_same_mesh(const Grid& grid, const std::string& file) const;
  void copy_positions(const Place& place, std::vector<float>& into) const;

  std::vector<std::filesystem::path> files_;
  ReadGrid read_;
  Cells cells_;                        // of the first file
  std::size_t points_ = 0;             // of the first file
  std::vector<std::uint32_t> welded_;  // of a triangle soup: point -> the first point with its coordinates
  std::vector<double> ids_;            // of nodes and cells in the first file, as far as it has them
  SourcedMesh sourced_;
  std::vector<FieldSource> sources_;
  std::vector<bake::SimulationField> fields_;
  std::vector<Place> states_;
  Grid grid_;  // the file read last
  std::size_t loaded_ = 0;
};

}  // namespace lbea::io::grid
