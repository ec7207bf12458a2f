// The models that lbea-serve matches with: of one component, or of several in the same frames.
#pragma once

#include "tools/serve/rigs.hpp"
#include "tools/shared/matching/component_engine.hpp"

#include <span>

namespace lbea::tool {

struct ServedModel {
  std::string name, file;
  Model model;
};

/// Throws WrongUsage when two components would have the same name, or there are too many.
[[nodiscard]] std::vector<std::string> component_names(const std::vector<std::string>& files);
/// Throws Error{bad_config} when a model cannot be matched with the same frames as the others.
void require_beside(const ServedModel& served, std::span<const ServedModel> others);
/// Throws the errors of Model::open(), component_names() and require_beside().
[[nodiscard]] std::vector<ServedModel> open_models(const std::vector<std::string>& files);
/// For a ModelComponents, with the depth images of each component between the others of its test. Throws as views_for()
/// and assembled_views() do.
[[nodiscard]] std::vector<ComponentModel> matched_components(const std::vector<ServedModel>& models,
                                                             const NamedRig& rig, const MatcherConfig& config);

}  // namespace lbea::tool
