#include "tools/serve/components.hpp"

#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/assembled_views.hpp"

#include <algorithm>
#include <span>

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
    for (const ServedModel& other : std::span(models).first(i))
      if (other.model.checksum() == model.checksum())
        throw Error(Status::bad_config, files[i] + " is the same model as " + other.file +
                                            "; give each component once, else its evidence counts twice");
    if (model.length_unit() != first.length_unit())
      throw Error(Status::bad_config, files[i] + ": its lengths are in " + std::string(model.length_unit()) +
                                          ", those of " + files.front() + " in " + std::string(first.length_unit()) +
                                          ", but frames have one unit; bake both with the same length_unit");
  }
  return models;
}

std::vector<ComponentModel> matched_components(const std::vector<ServedModel>& models, const ServedRig& rig,
                                               const MatcherConfig& config) {
  std::vector<ComponentModel> components;
  for (const ServedModel& served : models) components.push_back({served.name, served.model});
  complete_views(components, config, rig.sensor_json, rig.pose_file);
  return components;
}

}  // namespace lbea::tool
