// A run's positions on the model's nodes: by number where the meshes are the same, by place where they are not.
#pragma once

#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea::tool {

class TrueMesh {
 public:
  /// mesh: of the run, undeformed. Same node numbers at about the same places (within the mean edge length in the
  /// mean): the same mesh. Else every model node is carried by the nearest place on the run's undeformed surface.
  /// Throws Error{bad_input} when the run has no surface.
  TrueMesh(const bake::SimulationMesh& mesh, const Model& model);

  [[nodiscard]] bool same_mesh() const noexcept { return elements_.size() > 0; }
  /// run: the run's nodes x 3; into: becomes model nodes x 3.
  void positions(std::span<const float> run, std::vector<float>& into) const;
  /// On the same mesh: the run's element of every model element. Empty on another.
  [[nodiscard]] std::span<const std::uint32_t> elements() const noexcept { return elements_; }

 private:
  bool find_by_number(const bake::SimulationMesh& mesh, const Model& model);
  void find_by_place(const bake::SimulationMesh& mesh, const Model& model);

  struct Carrier {
    std::array<std::uint32_t, 3> nodes{};
    std::array<float, 3> shares{1, 0, 0};
  };
  std::vector<Carrier> carriers_;  // model nodes
  std::vector<std::uint32_t> elements_;
};

}  // namespace lbea::tool
