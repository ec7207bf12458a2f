#include "tools/shared/views/assembled_views.hpp"

#include "adapters/files/file_names.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "precompute/depth_images/rendered_views.hpp"
#include "precompute/rig/depth_renderer.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "runtime/src/track/same_runs.hpp"
#include "tools/shared/intake/log.hpp"
#include "tools/shared/views/box_of_samples.hpp"
#include "tools/shared/views/views.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

/// The meshes of all components as one.
class Assembly {
 public:
  Assembly(const Model& model, const std::vector<Model>& others) : models_{model} {
    models_.insert(models_.end(), others.begin(), others.end());
    for (const Model& part : models_) {
      numbers_.push_back(numbers_by_name(model, part));
      for (std::size_t i = 0; i < part.element_nodes().size(); ++i) {
        if (i % 4 == 0) elements_.emplace_back();
        elements_.back()[i % 4] = static_cast<std::uint32_t>(nodes_) + part.element_nodes()[i];
      }
      nodes_ += part.nodes();
    }
  }
  [[nodiscard]] std::size_t nodes() const noexcept { return nodes_; }
  [[nodiscard]] const std::vector<std::array<std::uint32_t, 4>>& elements() const noexcept { return elements_; }
  /// In the state of a sample of the first model.
  [[nodiscard]] std::vector<float> positions(std::uint32_t index) const {
    std::vector<float> all;
    all.reserve(3 * nodes_);
    for (std::size_t i = 0; i < models_.size(); ++i) {
      const auto part = models_[i].node_positions(same_sample(i, index));
      all.insert(all.end(), part.begin(), part.end());
    }
    return all;
  }
  /// Per element 1 or, where the sample lacks it, 0.
  [[nodiscard]] std::vector<std::uint8_t> present(std::uint32_t index) const {
    std::vector<std::uint8_t> all;
    for (std::size_t i = 0; i < models_.size(); ++i) {
      const std::vector<std::uint8_t> part = present_elements(models_[i], same_sample(i, index));
      all.insert(all.end(), part.begin(), part.end());
      if (part.empty()) all.resize(all.size() + models_[i].elements(), 1);
    }
    return all;
  }

 private:
  /// The sample of a model at the time of a sample of the first one.
  [[nodiscard]] std::uint32_t same_sample(std::size_t model, std::uint32_t index) const {
    const Sample sample = models_.front().sample(index);
    return models_[model].sample_index({numbers_[model][sample.simulation], sample.time_step});
  }

  std::vector<Model> models_;
  std::vector<std::vector<std::uint32_t>> numbers_;  // per model, of the first one's simulations
  std::vector<std::array<std::uint32_t, 4>> elements_;
  std::size_t nodes_ = 0;
};

/// The middle of the surface in a cell, reference coordinates.
std::array<float, 3> place_of(const DepthCamera& camera, std::size_t cell, std::uint16_t stored) {
  const float depth = camera.depth_origin + camera.depth_step * static_cast<float>(stored);
  const float x = (static_cast<float>(cell % camera.columns) + 0.5f - camera.center_column) / camera.focal * depth,
              y = (static_cast<float>(cell / camera.columns) + 0.5f - camera.center_row) / camera.focal * depth;
  const RigidTransform& T = camera.T_reference_sensor;
  std::array<float, 3> place{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    place[axis] = T[4 * axis] * x + T[4 * axis + 1] * y + T[4 * axis + 2] * depth + T[4 * axis + 3];
  return place;
}

/// Empties the cells whose points the matcher discards: those outside the envelope, or of the range of depths, at the
/// ends of which images show everything beyond.
void keep_inside(const DepthCamera& camera, const CellGrid& envelope, std::span<std::uint16_t> image) {
  constexpr std::uint16_t lowest = fill_levels, highest = 65'535 - fill_levels;
  for (std::size_t cell = 0; cell < camera.cells(); ++cell)
    if (image[cell] != empty_cell && (image[cell] <= lowest || image[cell] >= highest ||
                                      envelope.rank_of(place_of(camera, cell, image[cell])) == CellGrid::outside))
      image[cell] = empty_cell;
}

/// The others of the component's test.
std::vector<Model> neighbors_of(std::size_t component, const std::vector<ComponentModel>& components) {
  std::vector<Model> others;
  for (const std::vector<std::size_t>& group : coupled(components))
    if (std::ranges::find(group, component) != group.end())
      for (const std::size_t i : group)
        if (i != component) others.push_back(components[i].model);
  return others;
}

/// Nothing without the description of a whole rig.
std::optional<bake::StereoSensor> sensor_of(const std::string& sensor_json, const std::string& name,
                                            std::string_view length_unit) {
  if (sensor_json.empty()) return {};
  try {
    return io::parse_sensor_json(sensor_json, io::path_of(name), length_unit).sensor;
  } catch (const Error& error) {
    log_warning("frames are matched as if they showed each component alone, because {}", error.what());
    return {};
  }
}

}  // namespace

SensorViews assembled_views(const Model& model, const std::vector<Model>& others, const bake::StereoSensor& sensor) {
  const Assembly assembly(model, others);
  const SampleBox box = box_of_samples(model);
  const auto renderer = bake::make_depth_renderer(sensor, assembly.nodes(), assembly.elements(), box.low, box.high);
  const CellGrid envelope = envelope_grid(model.view().envelope);
  const auto render = [&](std::uint32_t sample, std::span<std::uint16_t> image) {
    renderer->render(assembly.positions(sample), assembly.present(sample), image);
    keep_inside(renderer->camera(), envelope, image);
  };
  return rendered_until_stop([&](const bake::Workers& workers) {
    return bake::render_depth_images(model, renderer->camera(), render, workers);
  });
}

void complete_views(std::vector<ComponentModel>& components, const MatcherConfig& config,
                    const std::string& sensor_json, const std::string& name) {
  const bool is_fit = config.method == Method::fit;
  const auto sensor = is_fit ? sensor_of(sensor_json, name, components.front().model.length_unit()) : std::nullopt;
  for (std::size_t i = 0; i < components.size(); ++i) {
    ComponentModel& component = components[i];
    const std::vector<Model> others = neighbors_of(i, components);
    if (!sensor || others.empty()) {
      component.views = views_for(config, component.model, sensor_json, name);
      continue;
    }
    log_info("rendering {} samples of {} between the other components", component.model.samples(), component.name);
    component.views = assembled_views(component.model, others, *sensor);
  }
}

}  // namespace lbea::tool
