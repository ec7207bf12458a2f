// Small meshes before a small stereo pair.
#pragma once

#include "precompute/rig/virtual_sensor.hpp"

#include <array>
#include <cmath>
#include <vector>

namespace lbea::test {

using namespace lbea::bake;

struct Scene {
  std::vector<float> positions;
  std::vector<std::array<std::uint32_t, 4>> elements;

  [[nodiscard]] std::size_t nodes() const { return positions.size() / 3; }
  void add(const std::array<std::array<float, 3>, 4>& corners) {
    const auto first = static_cast<std::uint32_t>(nodes());
    for (const auto& corner : corners) positions.insert(positions.end(), corner.begin(), corner.end());
    elements.push_back({first, first + 1, first + 2, first + 3});
  }
  /// One quad across the optical axis.
  void add_plate(float x0, float x1, float y0, float y1, float depth) {
    add({{{x0, y0, depth}, {x1, y0, depth}, {x1, y1, depth}, {x0, y1, depth}}});
  }
};

inline constexpr float baseline = 200;

/// Both cameras look along z; the right one's eye is `baseline` to the right of the left one's.
inline StereoSensor parallel_sensor() {
  StereoSensor sensor;
  sensor.focal_px = 100;
  sensor.width_px = 120;
  sensor.height_px = 80;
  sensor.T_reference_right[3] = baseline;
  return sensor;
}

inline VirtualSensor look_at(const Scene& scene, const StereoSensor& sensor = parallel_sensor()) {
  return VirtualSensor(sensor, scene.nodes(), scene.elements);
}

inline constexpr SensingNoise noiseless{0, 0, 0.17f, 0, 0};

/// How many of `pixels` pixel centres, seen with the given focal length, lie in [from, to] at `depth`.
inline std::size_t pixels_between(double from, double to, double depth, std::uint32_t pixels, double focal) {
  std::size_t count = 0;
  for (std::uint32_t i = 0; i < pixels; ++i) {
    const double at = (i + 0.5 - 0.5 * pixels) / focal * depth;
    count += at >= from && at <= to ? 1 : 0;
  }
  return count;
}

}  // namespace lbea::test
