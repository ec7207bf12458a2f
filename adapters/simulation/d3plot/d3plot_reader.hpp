// A d3plot family as a SimulationReader.
#pragma once

#include <vector>

#include "adapters/simulation/d3plot/d3plot_database.hpp"
#include "adapters/simulation/d3plot/d3plot_surface.hpp"
#include "adapters/simulation/d3plot/d3plot_values.hpp"
#include "precompute/simulation.hpp"

namespace lbea::io::d3plot {

class Reader final : public bake::SimulationReader {
 public:
  /// See open_d3plot().
  explicit Reader(const std::filesystem::path& first_file);

  [[nodiscard]] const bake::SimulationMesh& mesh() const noexcept override { return mesh_; }
  [[nodiscard]] const std::vector<bake::SimulationField>& fields() const noexcept override { return fields_; }
  [[nodiscard]] std::uint32_t states() const noexcept override {
    return static_cast<std::uint32_t>(database_.states.size());
  }
  [[nodiscard]] double time_s(std::uint32_t state) const override { return place(state).time_s; }
  void read(std::uint32_t state, bake::SimulationState& into) override;
  [[nodiscard]] std::vector<std::filesystem::path> files() const override { return database_.family; }

 private:
  [[nodiscard]] const StatePlace& place(std::uint32_t state) const;
  void build_mesh();
  void add_elements(const std::vector<SurfaceElement>& faces, const std::vector<std::uint32_t>& ids,
                    const std::vector<std::uint32_t>& parts);
  void keep_used_nodes();
  void number_shell_rows();
  void read_positions(const StatePlace& place, std::vector<float>& into);
  void read_alive(const StatePlace& place, std::vector<std::uint8_t>& into);
  void read_fields(const StatePlace& place, bake::SimulationState& into);
  std::vector<std::vector<float>> read_rows(const StatePlace& place, const Block& block, const RowFields& row);

  Database database_;
  StateFile file_;
  bake::SimulationMesh mesh_;
  std::vector<Field> stored_;
  std::vector<bake::SimulationField> fields_;
  std::size_t shell_elements_ = 0;          // the mesh's first elements are shells, the others faces of solids
  std::vector<std::uint32_t> source_;       // element -> shell or solid of the database
  std::vector<std::uint32_t> node_source_;  // node -> node of the database
  std::vector<std::uint32_t> shell_row_;    // shell -> its row in a state, or no_row
  std::vector<float> scratch_;
};

}  // namespace lbea::io::d3plot
