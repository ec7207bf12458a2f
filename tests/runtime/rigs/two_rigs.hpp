// Bending plates under two rigs: one looks down on them, one up.
#pragma once

#include "precompute/depth_images/rendered_views.hpp"
#include "tests/runtime/fit/seen_plates.hpp"

#include <lbea/rigs.hpp>

namespace lbea::test {

inline StereoSensor rig_below() {
  StereoSensor rig = rig_above();
  rig.T_reference_sensor = {1, 0, 0, 95, 0, 1, 0, 45, 0, 0, 1, -600};
  rig.T_reference_right = {1, 0, 0, 135, 0, 1, 0, 45, 0, 0, 1, -600};
  return rig;
}

inline SensorViews views_from(const StereoSensor& rig, const Model& model) {
  const SimulationMesh mesh = plate_mesh();
  const auto renderer = make_depth_renderer(rig, mesh.nodes(), mesh.elements, {-200, -30, -10}, {210, 120, 200});
  return render_depth_images(model, *renderer, 2);
}

inline std::vector<Point> seen_from(const StereoSensor& rig, const std::vector<float>& positions,
                                    std::uint64_t seed = 1) {
  const SimulationMesh mesh = plate_mesh();
  return VirtualSensor(rig, mesh.nodes(), mesh.elements).sense({positions}, {}, seed);
}

inline std::vector<float> positions_of(const Model& model, std::uint32_t sample) {
  const auto positions = model.node_positions(sample);
  return {positions.begin(), positions.end()};
}

/// Of the rig below and the model of seen_plates_model(); rendered once.
inline SensorViews views_from_below(std::uint32_t runs, std::uint32_t states, const Model& model) {
  static std::map<std::array<std::uint32_t, 2>, SensorViews> rendered;
  const auto found = rendered.find({runs, states});
  if (found != rendered.end()) return found->second;
  return rendered.emplace(std::array{runs, states}, views_from(rig_below(), model)).first->second;
}

/// Six runs under two rigs.
struct TwoRigs {
  explicit TwoRigs(std::uint32_t states = 8, std::uint32_t runs = 6)
      : bytes(seen_plates_model(runs, states)),
        rigs{{sensors[0].T_reference_sensor, {}},
             {sensors[1].T_reference_sensor, views_from_below(runs, states, model)}} {}

  AlignedBytes bytes;
  Model model = Model::view(bytes.span());
  std::vector<StereoSensor> sensors{rig_above(), rig_below()};
  std::vector<Rig> rigs;

  [[nodiscard]] RigMatcher matcher() const {
    RigMatcher matcher(model, fit_config(), rigs);
    matcher.fix_poses();
    return matcher;
  }
};

/// Of the best sample. Several runs have the same shape at different times.
inline double distance(const Model& model, const MatchResult& result, const std::vector<float>& positions) {
  return mean_distance(model.node_positions(model.sample_index(result.matches.front().sample)), positions);
}

inline Frame at(double ms, std::span<const Point> points) {
  return {static_cast<std::uint64_t>(ms), static_cast<std::int64_t>(ms * 1e6), points};
}

}  // namespace lbea::test
