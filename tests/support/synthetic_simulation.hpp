// Simulations from formulas, in memory: bending plates.
#pragma once

#include "precompute/simulation.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <utility>
#include <vector>

namespace lbea::test {

using namespace lbea::bake;

/// A run with the given states.
class SyntheticSimulation : public SimulationReader {
 public:
  SyntheticSimulation(SimulationMesh mesh, std::vector<SimulationState> run_states,
                      std::vector<SimulationField> run_fields = {})
      : mesh_(std::move(mesh)), states_(std::move(run_states)), fields_(std::move(run_fields)) {}

  const SimulationMesh& mesh() const noexcept override { return mesh_; }
  const std::vector<SimulationField>& fields() const noexcept override { return fields_; }
  std::uint32_t states() const noexcept override { return static_cast<std::uint32_t>(states_.size()); }
  double time_s(std::uint32_t state) const override { return states_.at(state).time_s; }
  void read(std::uint32_t state, SimulationState& into) override { into = states_.at(state); }
  std::vector<std::filesystem::path> files() const override { return {}; }

 private:
  SimulationMesh mesh_;
  std::vector<SimulationState> states_;
  std::vector<SimulationField> fields_;
};

/// A plate of (columns - 1) x (rows - 1) quads in the plane z = 0. Node ids from 1001, element ids from 501. The half
/// with small x is part 1, the other half part 2.
struct PlateShape {
  std::uint32_t columns = 20, rows = 10;  // nodes along x and y
  float length = 190, width = 90;         // along x and y
};

inline SimulationMesh plate_mesh(const PlateShape& shape = {}) {
  SimulationMesh mesh;
  for (std::uint32_t j = 0; j < shape.rows; ++j)
    for (std::uint32_t i = 0; i < shape.columns; ++i) {
      const float x = shape.length * static_cast<float>(i) / static_cast<float>(shape.columns - 1);
      const float y = shape.width * static_cast<float>(j) / static_cast<float>(shape.rows - 1);
      mesh.positions.insert(mesh.positions.end(), {x, y, 0});
      mesh.node_ids.push_back(1001 + j * shape.columns + i);
    }
  for (std::uint32_t j = 0; j + 1 < shape.rows; ++j)
    for (std::uint32_t i = 0; i + 1 < shape.columns; ++i) {
      const std::uint32_t node = j * shape.columns + i;
      mesh.elements.push_back({node, node + 1, node + 1 + shape.columns, node + shape.columns});
      mesh.element_ids.push_back(501 + j * (shape.columns - 1) + i);
      mesh.element_parts.push_back(2 * i < shape.columns - 1 ? 1 : 2);
    }
  return mesh;
}

/// The mesh bent along x without stretching into an arc of `angle` (radians) over `length`. Its field 0 is `angle`
/// times the distance of the element from the clamped end divided by the length.
inline SimulationState bent_state(const SimulationMesh& mesh, double time_s, double angle, double length) {
  SimulationState state;
  state.time_s = time_s;
  state.positions = mesh.positions;
  const double curvature = angle / length;
  for (std::size_t i = 0; i < mesh.nodes() && curvature != 0; ++i) {
    const double x = static_cast<double>(mesh.positions[3 * i]);
    state.positions[3 * i] = static_cast<float>(std::sin(curvature * x) / curvature);
    state.positions[3 * i + 2] += static_cast<float>((1 - std::cos(curvature * x)) / curvature);
  }
  state.alive.assign(mesh.elements.size(), 1);
  state.fields.emplace_back();
  for (const auto& element : mesh.elements)
    state.fields[0].push_back(static_cast<float>(angle * static_cast<double>(mesh.positions[3 * element[0]]) / length));
  return state;
}

/// Bends from flat to `final_angle` in equal steps of 0.5 ms.
inline SyntheticSimulation bending_plate(double final_angle, std::uint32_t steps, const PlateShape& shape = {}) {
  const SimulationMesh mesh = plate_mesh(shape);
  std::vector<SimulationState> states;
  for (std::uint32_t step = 0; step < steps; ++step) {
    const double share = steps > 1 ? static_cast<double>(step) / (steps - 1) : 0.0;
    states.push_back(bent_state(mesh, 0.0005 * step, final_angle * share, static_cast<double>(shape.length)));
  }
  return {mesh, std::move(states), {{"plastic_strain", "1"}}};
}

}  // namespace lbea::test
