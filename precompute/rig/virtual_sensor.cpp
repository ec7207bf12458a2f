#include "precompute/rig/virtual_sensor.hpp"

#include "precompute/rig/rig.hpp"

#include <cmath>

namespace lbea::bake {
namespace {
std::uint32_t scaled_size(std::uint32_t pixels, double factor) {
  const double size = std::round(pixels * factor);
  if (!(size >= 1 && size <= std::numeric_limits<std::uint32_t>::max()))
    throw Error{Status::bad_config, "a resolution scale of " + std::to_string(factor) + " makes no image of " +
                                        std::to_string(pixels) + " px; take a number near 1"};
  return static_cast<std::uint32_t>(size);
}
}  // namespace

StereoSensor scaled(const StereoSensor& sensor, double factor) {
  StereoSensor result = sensor;
  result.width_px = scaled_size(sensor.width_px, factor);
  result.height_px = scaled_size(sensor.height_px, factor);
  result.focal_px = static_cast<float>(sensor.focal_px * factor);
  return result;
}

VirtualSensor::VirtualSensor(const StereoSensor& sensor, std::size_t nodes,
                             std::span<const std::array<std::uint32_t, 4>> elements)
    : rig_(std::make_unique<const sensing::Rig>(sensor, nodes, elements)) {}
VirtualSensor::~VirtualSensor() = default;
VirtualSensor::VirtualSensor(VirtualSensor&&) noexcept = default;
VirtualSensor& VirtualSensor::operator=(VirtualSensor&&) noexcept = default;
const StereoSensor& VirtualSensor::sensor() const noexcept { return rig_->sensor; }

SensorImage VirtualSensor::image(const SurfaceState& state, float min_cos_incidence) const {
  sensing::PlacedMesh mesh(*rig_, state);
  SensorImage image;
  mesh.render(min_cos_incidence, image);
  return image;
}

std::vector<float> VirtualSensor::depth_image(const SurfaceState& state) const { return image(state).depth; }

std::vector<Point> VirtualSensor::sense(const SurfaceState& state, const SensingNoise& noise,
                                        std::uint64_t seed) const {
  sensing::PlacedMesh mesh(*rig_, state);
  return sensing::measure(*rig_, mesh, noise, seed);
}

std::vector<std::uint8_t> VirtualSensor::visible_nodes(const SurfaceState& state, float min_cos_incidence) const {
  sensing::PlacedMesh mesh(*rig_, state);
  std::vector<std::uint8_t> visible(rig_->nodes, 0);
  for (const auto& triangle : mesh.triangles())
    for (const std::uint32_t node : triangle)
      if (visible[node] == 0)
        visible[node] = rig_->faces_both(mesh.nodes()[node], mesh.normal(triangle), min_cos_incidence);
  const auto from_left = mesh.seen_from_left(mesh.nodes()), from_right = mesh.seen_from_right(mesh.nodes());
  for (std::size_t node = 0; node < visible.size(); ++node)
    visible[node] = visible[node] != 0 && from_left[node] != 0 && from_right[node] != 0;
  return visible;
}

std::vector<std::uint8_t> VirtualSensor::visible_elements(const SurfaceState& state, float min_cos_incidence) const {
  const SensorImage seen = image(state, min_cos_incidence);
  std::vector<std::uint8_t> visible(rig_->elements, 0);
  for (std::size_t pixel = 0; pixel < seen.pixels(); ++pixel)
    if (seen.measured[pixel] != 0) visible[seen.element[pixel]] = 1;
  return visible;
}
}  // namespace lbea::bake
