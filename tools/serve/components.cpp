#include "tools/serve/components.hpp"

#include "tools/shared/views/assembled_views.hpp"

namespace lbea::tool {

std::vector<ComponentModel> matched_components(const std::vector<NamedModel>& models, const NamedRig& rig,
                                               const MatcherConfig& config) {
  std::vector<ComponentModel> components;
  for (const NamedModel& named : models) components.push_back({named.name, named.model});
  complete_views(components, config, rig.sensor_json, rig.pose_file);
  return components;
}

}  // namespace lbea::tool
