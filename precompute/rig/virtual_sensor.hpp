// What the stereo rig would measure of a simulated state: rendered, then disturbed by noise.
#pragma once

#include "precompute/rig/stereo_sensor.hpp"

namespace lbea::bake {
namespace sensing {
struct Rig;
}

inline constexpr std::uint32_t no_element = 0xffff'ffff;

/// One value per pixel of the left camera, row by row from the top left.
struct SensorImage {
  std::uint32_t width_px = 0, height_px = 0;
  std::vector<float> depth;            // along the optical axis, length unit; NaN where the left camera sees nothing
  std::vector<std::uint32_t> element;  // no_element where the left camera sees nothing
  std::vector<std::uint8_t> measured;  // 1 where the right camera sees the same point, neither along the surface

  [[nodiscard]] std::size_t pixels() const noexcept { return depth.size(); }
};

/// The same rig with another resolution: width, height and focal length times `factor`; a cloud has about factor^2
/// times the points. Throws Error{bad_config} when the image would be empty or too large.
[[nodiscard]] StereoSensor scaled(const StereoSensor& sensor, double factor);

/// One state of the mesh. `positions`: nodes x 3 in reference coordinates; elements with
/// a position that is not finite are not seen. `alive`: one per element, 0 = eroded; empty: all alive.
struct SurfaceState {
  std::span<const float> positions;
  std::span<const std::uint8_t> alive{};
};

/// Sees one mesh topology. All functions are const and safe to call from several threads; images and visibility are
/// the same on every machine. A state of the wrong size throws Error{bad_input}.
class VirtualSensor {
 public:
  /// `elements`: node indices, a triangle repeats its last node; quads are split along nodes 0-2.
  /// Throws Error{bad_config} for an invalid sensor and Error{bad_input} for an element that names a node beyond
  /// `nodes`.
  VirtualSensor(const StereoSensor& sensor, std::size_t nodes, std::span<const std::array<std::uint32_t, 4>> elements);
  ~VirtualSensor();
  VirtualSensor(VirtualSensor&&) noexcept;
  VirtualSensor& operator=(VirtualSensor&&) noexcept;

  [[nodiscard]] const StereoSensor& sensor() const noexcept;

  /// The state through the left camera, without noise.
  [[nodiscard]] SensorImage image(const SurfaceState& state,
                                  float min_cos_incidence = SensingNoise{}.min_cos_incidence) const;
  /// The depths of image(): height x width.
  [[nodiscard]] std::vector<float> depth_image(const SurfaceState& state) const;

  /// Points in sensor coordinates, in pixel order: one per measured pixel with Gaussian noise along the line of
  /// sight, without the dropouts. An outlier lies elsewhere on its line of sight, uniformly within 3 % of its
  /// distance. Background points lie on a wall across the optical axis, 1.2 times as far as the farthest node.
  /// Where the mesh leaves fewer empty pixels than asked for, all of those are background.
  /// Throws Error{bad_config} for noise that is negative or not finite, or a share of points beyond 1.
  [[nodiscard]] std::vector<Point> sense(const SurfaceState& state, const SensingNoise& noise,
                                         std::uint64_t seed) const;

  /// One per node: 1 when it lies in both images, nothing hides it from either camera, and an element around it
  /// shows both cameras the same side at no less than the incidence asked for.
  [[nodiscard]] std::vector<std::uint8_t> visible_nodes(
      const SurfaceState& state, float min_cos_incidence = SensingNoise{}.min_cos_incidence) const;
  /// One per element: 1 when at least one pixel measures it.
  [[nodiscard]] std::vector<std::uint8_t> visible_elements(
      const SurfaceState& state, float min_cos_incidence = SensingNoise{}.min_cos_incidence) const;

 private:
  std::unique_ptr<const sensing::Rig> rig_;
};
}  // namespace lbea::bake
