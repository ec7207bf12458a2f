// The places of the reference mesh that a mapping looks for on other meshes.
#pragma once

#include "precompute/mapping/part_surfaces.hpp"

namespace lbea::bake {
/// The outer elements of the reference mesh, undeformed.
class ReferencePlaces {
 public:
  static constexpr std::size_t quarters = 4;

  explicit ReferencePlaces(const SimulationMesh& mesh);

  [[nodiscard]] const SimulationMesh& mesh() const noexcept { return mesh_; }
  [[nodiscard]] std::size_t elements() const noexcept { return elements_; }
  [[nodiscard]] double diagonal() const noexcept { return diagonal_; }
  [[nodiscard]] std::array<double, 3> middle() const noexcept { return middle_; }
  /// Whether an outer element has the node.
  [[nodiscard]] bool has_node(std::size_t node) const noexcept { return first_[node] < first_[node + 1]; }
  [[nodiscard]] WantedPlace node(std::size_t node) const noexcept;
  /// The middle of a quarter of the element.
  [[nodiscard]] WantedPlace quarter(std::size_t element, std::size_t corner) const noexcept;

 private:
  [[nodiscard]] std::array<double, 3> position(std::uint32_t node) const noexcept;

  const SimulationMesh& mesh_;
  std::size_t elements_;
  double diagonal_ = 0;
  std::array<double, 3> middle_{};
  std::vector<std::uint32_t> first_;  // nodes + 1: where the entries of a node begin in the next two
  std::vector<std::uint32_t> parts_;  // of its elements
  std::vector<std::array<double, 3>> normals_;
  std::vector<std::array<double, 3>> element_normals_;
};
}  // namespace lbea::bake
