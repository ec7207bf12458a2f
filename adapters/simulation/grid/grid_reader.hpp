// A run whose states are mesh files, or displacements in one mesh file, as a SimulationReader.
#pragma once

#include "adapters/simulation/grid/grid_mesh.hpp"

#include <functional>

namespace lbea::io::grid {
struct GridState {
  std::filesystem::path file;
  std::optional<double> time = std::nullopt;         // default: the file's own time, else the number of the state
  std::optional<std::uint32_t> step = std::nullopt;  // in a file with several states

  [[nodiscard]] std::string name() const { return file.string() + (step ? ", step " + std::to_string(*step) : ""); }
};
using ReadState = std::function<Grid(const GridState& state)>;

inline constexpr std::string_view displacement_array = "displacement_t";

/// Whether a file has the states of a run as point arrays displacement_t<time>.
[[nodiscard]] bool holds_run(const Grid& grid);

/// All files must have the same cells and ids; positions and values may differ. A single file with point arrays
/// displacement_t<time> is a run with a state per array; the fields of a state are in arrays with the same ending.
class GridReader final : public bake::SimulationReader {
 public:
  /// Reads the first state completely and, where `states` has no time, the time of each other file with `read_time`.
  /// Without any times, a gap in the numbers of the files is refused. `list_parts`: of formats whose files name others.
  GridReader(std::vector<GridState> states, ReadState read_state, ReadGrid read_time, ListParts list_parts = nullptr);

  [[nodiscard]] const bake::SimulationMesh& mesh() const noexcept override { return sourced_.mesh; }
  [[nodiscard]] const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  [[nodiscard]] std::uint32_t states() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return place(state).time; }
  void read(std::uint32_t state, bake::SimulationState& into) override;
  [[nodiscard]] std::vector<std::filesystem::path> files() const override { return files_; }
  [[nodiscard]] std::vector<std::filesystem::path> named_files() const override { return parts_; }
  /// Of the states read so far: points that never move beside an array that looks like their displacements.
  [[nodiscard]] std::string remark() const override;

 private:
  struct Place {
    std::size_t given = 0;
    double time = 0;
    std::string suffix;  // of this state's arrays, in a file with all states
  };
  [[nodiscard]] const Place& place(std::uint32_t state) const;
  void check_positions(const std::string& name);
  void find_displacements(const Grid& grid);
  void find_times(const std::vector<GridState>& states, const Grid& first, ReadGrid read_time);
  void join(Grid& grid) const;
  void load(std::size_t given);
  void check_same_mesh(const Grid& grid, const std::string& file) const;
  void check_same_arrays(const Grid& grid, const std::string& file) const;
  void copy_positions(const Place& place, std::vector<float>& into) const;

  std::vector<GridState> given_;
  std::vector<std::filesystem::path> files_, parts_;  // each once
  ReadState read_;
  Cells cells_;                        // of the first file
  std::size_t points_ = 0;             // of the first file
  std::vector<std::uint32_t> joined_;  // of a soup or of pieces: point -> the first point that is the same node
  std::vector<double> ids_;            // of nodes and cells in the first file, if it has any
  SourcedMesh sourced_;
  std::vector<FieldSource> sources_;
  std::vector<bake::SimulationField> fields_;
  std::vector<Place> states_;
  std::string unused_vector_;  // array of the first file that looks like displacements of its points
  bool has_read_later_ = false, has_moved_ = false;
  bool has_flags_ = false;  // of eroded elements, in the first file
  Grid grid_;               // of the last file read
  std::size_t loaded_ = 0;
};
}  // namespace lbea::io::grid
