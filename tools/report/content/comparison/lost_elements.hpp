// What the simulation of the best sample has lost by erosion.
#pragma once

#include <lbea/lbea.hpp>

#include <string>

namespace lbea::tool {

/// A sentence with the number of elements that the simulation's first sample has and its last one lacks; empty: none,
/// or the model has no such simulation.
[[nodiscard]] std::string lost_elements_sentence(const Model& model, std::uint32_t simulation);

}  // namespace lbea::tool
