// The mesh of a model as a simulation has it.
#pragma once

#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

/// The common mesh of the model, with the positions of its first sample.
[[nodiscard]] inline bake::SimulationMesh mesh_of(const Model& model) {
  bake::SimulationMesh mesh;
  const auto positions = model.node_positions(0);
  const auto corners = model.element_nodes();
  mesh.positions.assign(positions.begin(), positions.end());
  mesh.node_ids.assign(model.node_ids().begin(), model.node_ids().end());
  mesh.element_ids.assign(model.element_ids().begin(), model.element_ids().end());
  mesh.element_parts.assign(model.element_parts().begin(), model.element_parts().end());
  for (std::size_t e = 0; e < model.elements(); ++e)
    mesh.elements.push_back({corners[4 * e], corners[4 * e + 1], corners[4 * e + 2], corners[4 * e + 3]});
  return mesh;
}

}  // namespace lbea::tool
