// Clouds for which a search of nearest points may have to test every point for every vertex.
#pragma once

#include "tools/bench/clouds.hpp"

namespace lbea::tool::bench {

/// As many points each as `ordinary`, a cloud of the component in reference coordinates: equal points, few places, tiny
/// balls, spheres, exponentially spaced and denormal coordinates. The same arguments give the same points.
[[nodiscard]] std::vector<BenchCloud> hostile_clouds(std::span<const Point> ordinary);

}  // namespace lbea::tool::bench
