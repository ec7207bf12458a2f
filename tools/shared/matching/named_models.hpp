// The models of the components that are in the same frames: of one, or of several.
#pragma once

#include <lbea/lbea.hpp>

#include <span>
#include <string>
#include <vector>

namespace lbea::tool {

struct NamedModel {
  std::string name, file;
  Model model;
};

/// In the model's order.
[[nodiscard]] std::vector<std::string> simulation_names(const Model& model);
/// Throws WrongUsage when two components would have the same name, or there are too many.
[[nodiscard]] std::vector<std::string> component_names(const std::vector<std::string>& files);
/// Throws Error{bad_config} when a model cannot be used with the same frames as the others.
void require_beside(const NamedModel& named, std::span<const NamedModel> others);
/// Throws the errors of Model::open(), component_names() and require_beside().
[[nodiscard]] std::vector<NamedModel> open_models(const std::vector<std::string>& files);

}  // namespace lbea::tool
