#include "tools/shared/matching/named_models.hpp"

#include "adapters/files/file_names.hpp"
#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/matching/component_engine.hpp"

#include <algorithm>

namespace lbea::tool {

std::vector<std::string> simulation_names(const Model& model) {
  std::vector<std::string> names;
  for (std::uint32_t i = 0; i < model.simulations(); ++i) names.emplace_back(model.simulation_name(i));
  return names;
}

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

void require_beside(const NamedModel& named, std::span<const NamedModel> others) {
  for (const NamedModel& other : others) {
    if (other.model.checksum() == named.model.checksum())
      throw Error(Status::bad_config, named.file + " is the same model as " + other.file +
                                          "; give each component once, else its evidence counts twice");
    const std::string_view unit = named.model.length_unit(), of_other = other.model.length_unit();
    if (unit != of_other)
      throw Error(Status::bad_config, named.file + ": its lengths are in " + std::string(unit) + ", those of " +
                                          other.file + " in " + std::string(of_other) +
                                          ", but frames have one unit; bake both with the same length_unit");
  }
}

std::vector<NamedModel> open_models(const std::vector<std::string>& files) {
  static_cast<void>(component_names(files));
  std::vector<NamedModel> models;
  for (const std::string& file : files) {
    const NamedModel named{component_name(file), file, Model::open(io::path_of(file))};
    require_beside(named, models);
    models.push_back(named);
  }
  return models;
}

}  // namespace lbea::tool
