#include "tools/shared/views/views.hpp"

#include "adapters/files/file_names.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "precompute/depth_images/rendered_views.hpp"
#include "precompute/rig/depth_renderer.hpp"
#include "tools/shared/cli/progress.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/views/box_of_samples.hpp"

#include <algorithm>
#include <cmath>
#include <mutex>

namespace lbea::tool {

SensorViews rendered_until_stop(const std::function<SensorViews(const bake::Workers&)>& render) {
  try {
    return render({0, [] { return stop_requested != 0; }});
  } catch (const bake::BakeCancelled&) {
    throw Error(Status::bad_input, "stopped while depth images were rendered and learned from");
  }
}

SensorViews rendered(const Model& model, const bake::StereoSensor& sensor) {
  std::vector<std::array<std::uint32_t, 4>> elements(model.elements());
  const auto flat = model.element_nodes();
  for (std::size_t i = 0; i < flat.size(); ++i) elements[i / 4][i % 4] = flat[i];
  const SampleBox box = box_of_samples(model);
  const auto renderer = bake::make_depth_renderer(sensor, model.nodes(), elements, box.low, box.high);
  Progress progress("rendering samples", model.samples());
  std::mutex one_at_a_time;
  std::size_t most = 0;
  return rendered_until_stop([&](const bake::Workers& workers) {
    return bake::render_depth_images(model, *renderer, workers, [&](std::size_t done) {
      const std::lock_guard lock(one_at_a_time);
      progress.advance_to(most = std::max(most, done));
    });
  });
}

bool suits(const RigidTransform& baked, const RigidTransform& wanted, std::string_view length_unit) noexcept {
  constexpr double max_degrees = 5, max_distance_mm = 30;  // the same surface is hidden up to here
  double trace = 0, squared = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t k = 0; k < 3; ++k) trace += double{baked[4 * i + k]} * double{wanted[4 * i + k]};
    squared += std::pow(double{baked[4 * i + 3]} - double{wanted[4 * i + 3]}, 2);
  }
  const double degrees = std::acos(std::clamp((trace - 1) / 2, -1.0, 1.0)) * 57.29577951308232;
  return degrees <= max_degrees && std::sqrt(squared) <= max_distance_mm * units_per_mm(length_unit);
}

bool has_images_for(const RigidTransform& T_reference_sensor, const Model& model) {
  const SensorViews baked = SensorViews::baked_into(model, T_reference_sensor);
  return !baked.empty() && suits(baked.T_reference_sensor(), T_reference_sensor, model.length_unit());
}

SensorViews views_for(const MatcherConfig& config, const Model& model, const std::string& sensor_json,
                      const std::string& name) {
  if (config.method != Method::fit) return {};
  const SensorViews baked = SensorViews::baked_into(model, config.T_reference_sensor);
  if (has_images_for(config.T_reference_sensor, model)) return baked;
  if (sensor_json.empty())
    throw Error(
        Status::bad_config,
        baked.empty()
            ? "the model holds no depth images; give the rig with --pose sensor.json, or bake with --views"
            : "the model's depth images were rendered for another pose; give this rig's with --pose sensor.json, of "
              "several rigs with --pose NAME=sensor.json");
  log_info("the model holds no depth images for this pose: rendering {} samples", model.samples());
  return rendered(model, io::parse_sensor_json(sensor_json, io::path_of(name)).sensor);
}

}  // namespace lbea::tool
