#include "tools/serve/components.hpp"

#include "adapters/files/file_names.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/assembled_views.hpp"

#include <algorithm>

namespace lbea::tool {

std::vector<std::string> component_names(const std::vector<std::string>& files) {
  if (files.size() > wire::most_components)
    throw WrongUsage("give at most " + std::to_string(wire::most_components) + " models, one per component");
  std::vector<std::string> names;
  for (const std::string& file : files) {
    const std::string name = component_name(file);
    if (std::ranges::find(names, name) != names.end())
      throw WrongUsage(file + ": another model's component is also named " + name +
                       "; components are named after their files, so rename one of them");
    names.push_back(name);
  }
  return names;
}

void require_beside(const ServedModel& served, std::span<const ServedModel> others) {
  for (const ServedModel& other : others) {
    if (other.model.checksum() == served.model.checksum())
      throw Error(Status::bad_config, served.file + " is the same model as " + other.file +
                                          "; give each component once, else its evidence counts twice");
    const std::string_view unit = served.model.length_unit(), of_other = other.model.length_unit();
    if (unit != of_other)
      throw Error(Status::bad_config, served.file + ": its lengths are in " + std::string(unit) + ", those of " +
                                          other.file + " in " + std::string(of_other) +
                                          ", but frames have one unit; bake both with the same length_unit");
  }
}

std::vector<ServedModel> open_models(const std::vector<std::string>& files) {
  static_cast<void>(component_names(files));
  std::vector<ServedModel> models;
  for (const std::string& file : files) {
    const ServedModel served{component_name(file), file, Model::open(io::path_of(file))};
    require_beside(served, models);
    models.push_back(served);
  }
  return models;
}

std::vector<ComponentModel> matched_components(const std::vector<ServedModel>& models, const NamedRig& rig,
                                               const MatcherConfig& config) {
  std::vector<ComponentModel> components;
  for (const ServedModel& served : models) components.push_back({served.name, served.model});
  complete_views(components, config, rig.sensor_json, rig.pose_file);
  return components;
}

}  // namespace lbea::tool
