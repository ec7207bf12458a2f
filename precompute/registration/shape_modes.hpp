// How undeformed shapes differ: their mean and the few ways in which they vary most.
#pragma once

#include <cstddef>
#include <span>
#include <vector>

namespace lbea::bake {

struct ShapeModes {
  std::vector<float> mean;                // nodes x 3
  std::vector<std::vector<float>> modes;  // each nodes x 3, one standard deviation large; most varying first
};

/// Principal components of shapes with the same nodes. Modes that move the nodes by less than `least` (root mean
/// square) are left out, and all beyond the first `most`. One shape alone has no modes.
[[nodiscard]] ShapeModes shape_modes(std::span<const std::span<const float>> shapes, double least,
                                     std::size_t most = 6);

}  // namespace lbea::bake
