#include "tools/serve/components.hpp"

#include "adapters/rig/sensor_json.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/assembled_views.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>

namespace lbea::tool {

std::vector<std::string> component_names(const std::vector<std::string>& files) {
  if (files.size() > wire::most_components)
    throw WrongUsage("give at most " + std::to_string(wire::most_components) + " models, one per component");
  std::vector<std::string> names;
  for (const std::string& file : files) {
    const std::string name = std::filesystem::path(file).stem().string();
    if (std::ranges::find(names, name) != names.end())
      throw WrongUsage(file + ": another model's component is also named " + name +
                       "; components are named after their files, so rename one of them");
    names.push_back(name);
  }
  return names;
}

std::vector<ServedModel> open_models(const std::vector<std::string>& files) {
  const std::vector<std::string> names = component_names(files);
  std::vector<ServedModel> models;
  for (std::size_t i = 0; i < files.size(); ++i) {
    models.push_back({names[i], files[i], Model::open(files[i])});
    const Model &first = models.front().model, &model = models.back().model;
    if (model.length_unit() != first.length_unit())
      throw Error(Status::bad_config, files[i] + ": its lengths are in " + std::string(model.length_unit()) +
                                          ", those of " + files.front() + " in " + std::string(first.length_unit()) +
                                          ", but frames have one unit; bake both with the same length_unit");
  }
  return models;
}

namespace {

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
std::optional<bake::StereoSensor> sensor_of(const ServedRig& rig, std::string_view length_unit) {
  if (rig.sensor_json.empty()) return {};
  try {
    return io::parse_sensor_json(rig.sensor_json, rig.pose_file, length_unit).sensor;
  } catch (const Error& error) {
    spdlog::warn("frames are matched as if they showed one component alone, because {}", error.what());
    return {};
  }
}

}  // namespace

std::vector<ComponentModel> matched_components(const std::vector<ServedModel>& models, const ServedRig& rig,
                                               const MatcherConfig& config) {
  std::vector<ComponentModel> components;
  for (const ServedModel& served : models) components.push_back({served.name, served.model});
  const auto sensor = config.method == Method::fit ? sensor_of(rig, models.front().model.length_unit()) : std::nullopt;
  for (std::size_t i = 0; i < components.size(); ++i) {
    const std::vector<Model> others = neighbors_of(i, components);
    if (!sensor || others.empty()) {
      components[i].views = views_for(rig, config, components[i].model);
      continue;
    }
    spdlog::info("rendering {} samples of {} between the other components", components[i].model.samples(),
                 components[i].name);
    components[i].views = assembled_views(components[i].model, others, *sensor);
  }
  return components;
}

}  // namespace lbea::tool
