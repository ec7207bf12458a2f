// The true mesh of an experiment on the nodes of the model, and the error of a match (eq. 4).
#pragma once

#include "precompute/mapping/surface_mapping.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

/// The positions of a run on the nodes of the model.
class TrueMesh {
 public:
  /// mesh: of the run, undeformed. It counts as the mesh of the model when it has the same node and element numbers and
  /// edges of similar lengths, wherever it is. Otherwise every node of the model follows its place on the undeformed
  /// surface of the run, as runs with other meshes are mapped by a bake; nodes that have none follow the nearest point.
  /// Throws Error{bad_input} when the run has no surface.
  TrueMesh(const bake::SimulationMesh& mesh, const Model& model, const bake::MappingSettings& mapping);

  [[nodiscard]] bool same_mesh() const noexcept { return elements_.size() > 0; }
  /// run: nodes of the run x 3. into: set to model nodes x 3.
  void positions(std::span<const float> run, std::vector<float>& into) const;
  /// The element of the run for every element of the model. Empty when the meshes differ.
  [[nodiscard]] std::span<const std::uint32_t> elements() const noexcept { return elements_; }

 private:
  bool find_by_number(const bake::SimulationMesh& mesh, const Model& model);
  void find_by_place(const bake::SimulationMesh& mesh, const Model& model, const bake::MappingSettings& mapping);

  std::vector<bake::CarriedNode> carriers_;  // model nodes
  std::vector<std::uint32_t> elements_;
};

/// The fields of a run in a state, on the elements of the model.
struct TrueFields {
  std::vector<std::vector<float>> values;  // per field of the model; NaN: the run lacks it. Empty: the meshes differ
  std::vector<std::uint8_t> present;       // per element, 0 = eroded or covered; empty: the meshes differ
};
[[nodiscard]] TrueFields true_fields(const TrueMesh& mesh, const bake::SimulationReader& run,
                                     const bake::SimulationState& state, const Model& model);

/// truth.csv of sensed frames, with the run that they were sensed from.
class Truth {
 public:
  struct Row {
    std::uint64_t frame = 0;
    std::filesystem::path cloud;  // file of the frame
    std::int64_t stamp_ns = 0;
    double state = 0;  // of the run; the mesh is interpolated between states
    double time_s = 0;
  };

  /// `table`: truth.csv as written by lbea-sense; columns are found by name. Throws Error{bad_input} with file and
  /// line.
  Truth(const std::filesystem::path& table, std::unique_ptr<bake::SimulationReader> run, const Model& model);

  [[nodiscard]] const std::vector<Row>& rows() const noexcept { return rows_; }
  /// The row with this stamp; nullptr when there is none. Frame numbers do not identify rows: a sender that loops or
  /// skips frames renumbers them.
  [[nodiscard]] const Row* at(std::int64_t stamp_ns) const noexcept;
  /// The true mesh of a row, model nodes x 3. Valid until the next call.
  [[nodiscard]] const std::vector<float>& positions(const Row& row);

 private:
  void read_state(std::uint32_t state, std::vector<float>& into);

  std::vector<Row> rows_;
  std::unique_ptr<bake::SimulationReader> run_;
  TrueMesh mesh_;
  bake::SimulationState state_;
  std::vector<float> positions_, next_;
};

/// Makes the positions of nodes whose elements are all eroded NaN. alive: per element; positions: nodes x 3.
void hide_free_nodes(const bake::SimulationMesh& mesh, const std::vector<std::uint8_t>& alive,
                     std::vector<float>& positions);

/// EE, eq. 4: mean over the nodes of the whole mesh of |s^e_i - s*_i|, in the length unit; NaN where the experiment's
/// run has no node: it does not count. Both: nodes x 3.
[[nodiscard]] double experiment_error(std::span<const float> truth, std::span<const float> sample);

struct Oracle {
  std::uint32_t sample = 0;
  double error = 0;
};
/// The sample with the smallest EE, a lower bound for methods that choose a sample. Ties: the lower index.
[[nodiscard]] Oracle oracle(const Model& model, std::span<const float> truth);

}  // namespace lbea::tool
