#include "tools/serve/rigs.hpp"

#include "tools/shared/views/views.hpp"

namespace lbea::tool {

SensorViews views_for(const NamedRig& rig, const MatcherConfig& config, const Model& model) {
  MatcherConfig own = config;
  own.T_reference_sensor = rig.T_reference_sensor;
  return views_for(own, model, rig.sensor_json, rig.pose_file);
}

std::vector<Rig> matched_rigs(const std::vector<NamedRig>& rigs, const MatcherConfig& config, const Model& model) {
  std::vector<Rig> matched;
  for (const NamedRig& rig : rigs)
    matched.push_back({rig.T_reference_sensor, views_for(rig, config, model), rig.clock_offset_ns});
  return matched;
}

}  // namespace lbea::tool
