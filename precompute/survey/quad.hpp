// A surface element by its nodes.
#pragma once

#include <array>
#include <cstdint>

namespace lbea::bake {

/// A quad, split along its nodes 0-2; a triangle repeats its last node.
using Quad = std::array<std::uint32_t, 4>;

}  // namespace lbea::bake
