// What a reader should find in a database that the test writer wrote, computed from what was to be written.
#pragma once

#include "precompute/simulation.hpp"
#include "tests/support/d3plot_writer.hpp"

namespace lbea::test {

using namespace lbea::bake;

/// Ids, parts, connectivity and positions of the shells; the number of faces of the sample's solids.
void check_mesh(const D3plot& d, const SimulationMesh& mesh);

/// Time, positions, erosion and every field of state `s`, read into `state`.
void check_state(const D3plot& d, SimulationReader& run, std::uint32_t s, SimulationState& state);

}  // namespace lbea::test
