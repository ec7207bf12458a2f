// Bending plates of which a patch erodes late in some runs, whose free nodes fly away. Link lbea_precompute.
#pragma once

#include "tests/support/synthetic_model.hpp"

namespace lbea::test {

/// 4 x 4 elements in the middle of the plate, whose 3 x 3 inner nodes no other element has.
inline std::vector<std::size_t> patch_elements(const PlateShape& shape = {}) {
  std::vector<std::size_t> elements;
  for (std::size_t j = shape.rows / 2 - 2; j < shape.rows / 2 + 2; ++j)
    for (std::size_t i = shape.columns / 2 - 2; i < shape.columns / 2 + 2; ++i)
      elements.push_back(j * (shape.columns - 1) + i);
  return elements;
}
inline std::vector<std::size_t> patch_nodes(const PlateShape& shape = {}) {
  std::vector<std::size_t> nodes;
  for (std::size_t j = shape.rows / 2 - 1; j < shape.rows / 2 + 2; ++j)
    for (std::size_t i = shape.columns / 2 - 1; i < shape.columns / 2 + 2; ++i) nodes.push_back(j * shape.columns + i);
  return nodes;
}

/// The inner nodes fly 1 m upwards; the last values of the field are no strains.
inline void erode_patch(SimulationState& state, const PlateShape& shape = {}) {
  for (const std::size_t element : patch_elements(shape)) state.alive[element] = 0, state.fields[0][element] = 1e9f;
  for (const std::size_t node : patch_nodes(shape)) state.positions[3 * node + 2] += 1000;
}

/// As bending_plate(); the patch is eroded from the state `from` on.
inline SyntheticSimulation eroding_plate(double final_angle, std::uint32_t steps, std::uint32_t from,
                                         const PlateShape& shape = {}) {
  const SyntheticSimulation whole = bending_plate(final_angle, steps, shape);
  SyntheticSimulation plate = whole;
  std::vector<SimulationState> states(steps);
  for (std::uint32_t step = 0; step < steps; ++step) {
    plate.read(step, states[step]);
    if (step >= from) erode_patch(states[step], shape);
  }
  return {whole.mesh(), std::move(states), whole.fields()};
}

/// Two runs per angle, 0.5, 0.6, ... radians: "whole_0", "eroding_0", "whole_1", ... They differ only in the patch.
inline Ensemble eroding_plates(std::uint32_t pairs, std::uint32_t steps, std::uint32_t from,
                               const PlateShape& shape = {}) {
  Ensemble ensemble;
  for (std::uint32_t pair = 0; pair < pairs; ++pair)
    for (const bool erodes : {false, true})
      ensemble.runs.push_back({(erodes ? "eroding_" : "whole_") + std::to_string(pair), {}, [=] {
                                 return std::make_unique<SyntheticSimulation>(
                                     eroding_plate(0.5 + 0.1 * pair, steps, erodes ? from : steps, shape));
                               }});
  return ensemble;
}

}  // namespace lbea::test
