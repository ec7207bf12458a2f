// Bending plates under a stereo rig that looks down on them.
#pragma once

#include "precompute/rig/depth_renderer.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "tests/support/synthetic_model.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace lbea::test {

using namespace lbea::bake;

/// scale: units of length per mm.
inline StereoSensor rig_above(float scale = 1) {
  StereoSensor rig;
  rig.T_reference_sensor = {1, 0, 0, 95 * scale, 0, -1, 0, 45 * scale, 0, 0, -1, 600 * scale};
  rig.T_reference_right = {1, 0, 0, 135 * scale, 0, -1, 0, 45 * scale, 0, 0, -1, 600 * scale};
  rig.focal_px = 800;
  rig.width_px = 360;
  rig.height_px = 180;
  return rig;
}

inline BakeOptions with_views(unsigned threads = 0, float scale = 1) {
  BakeOptions options;
  options.threads = threads;
  options.depth_renderer = [scale](const CommonMesh& mesh, const std::array<float, 3>& low,
                                   const std::array<float, 3>& high) {
    return make_depth_renderer(rig_above(scale), mesh.node_ids.size(), mesh.elements, low, high);
  };
  return options;
}

/// Runs plate_0 ... bend to 0.5, 0.6, ... radians.
inline Ensemble similar_plates(std::uint32_t runs, std::uint32_t steps, const PlateShape& shape = {}) {
  Ensemble ensemble;
  for (std::uint32_t run = 0; run < runs; ++run)
    ensemble.runs.push_back({"plate_" + std::to_string(run), {}, [run, steps, shape] {
                               return std::make_unique<SyntheticSimulation>(
                                   bending_plate(0.5 + 0.1 * run, steps, shape));
                             }});
  return ensemble;
}

/// A copy: each is baked once, as that takes a second of processor time.
inline AlignedBytes seen_plates_model(std::uint32_t runs = 6, std::uint32_t steps = 8, unsigned threads = 0) {
  static std::map<std::array<std::uint32_t, 3>, AlignedBytes> baked;
  const auto found = baked.find({runs, steps, threads});
  if (found != baked.end()) return found->second;
  const TemporaryFolder folder;
  bake_model(similar_plates(runs, steps), bent_plates_description(), folder / "plates.lbea", with_views(threads));
  return baked.emplace(std::array{runs, steps, threads}, AlignedBytes(folder / "plates.lbea")).first->second;
}

/// What the rig sees of a plate bent by `angle`, or of any other state of its mesh.
inline std::vector<Point> seen(const std::vector<float>& positions, const SensingNoise& noise = {},
                               std::uint64_t seed = 1) {
  const SimulationMesh mesh = plate_mesh();
  return VirtualSensor(rig_above(), mesh.nodes(), mesh.elements).sense({positions}, noise, seed);
}
inline std::vector<float> bent(double angle) { return bent_state(plate_mesh(), 0, angle, 190).positions; }

inline MatcherConfig fit_config() {
  MatcherConfig config;
  config.method = Method::fit;
  config.T_reference_sensor = rig_above().T_reference_sensor;
  return config;
}

inline SensorViews changed(const SensorViews& views, const auto& change) {
  DepthImages images = *views.data();
  change(images);
  return SensorViews(std::make_shared<const DepthImages>(images));
}

/// One point per quarter of a cell of the depth image, the mean of its points: a frame without empty cells from any
/// pose, but a plane needs points of a total weight of 4, and these have 3 on average (4 per cell, times half the area
/// of a circle of 0.7 cells).
inline std::vector<Point> one_per_quarter(std::span<const Point> points, const DepthCamera& camera) {
  std::map<std::pair<int, int>, std::vector<Point>> quarters;
  for (const Point& p : points) {
    const auto half_cells = [&](float x) { return static_cast<int>(std::floor(2 * camera.focal * x / p.z)); };
    quarters[{half_cells(p.x), half_cells(p.y)}].push_back(p);
  }
  std::vector<Point> means;
  for (const auto& [quarter, inside] : quarters) {
    Point mean{};
    const float share = 1 / static_cast<float>(inside.size());
    for (const Point& p : inside) mean = {mean.x + share * p.x, mean.y + share * p.y, mean.z + share * p.z};
    means.push_back(mean);
  }
  return means;
}

/// Of the nodes of two shapes.
inline double mean_distance(std::span<const float> a, std::span<const float> b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.size(); i += 3)
    sum += std::hypot(double{a[i]} - double{b[i]}, double{a[i + 1]} - double{b[i + 1]},
                      double{a[i + 2]} - double{b[i + 2]});
  return 3 * sum / static_cast<double>(a.size());
}

/// Node positions of a combination of samples.
inline std::vector<float> mesh_of(const Model& model, std::span<const WeightedSample> estimate) {
  std::vector<float> mesh(std::size_t{3} * model.nodes());
  for (const auto& [sample, weight] : estimate) {
    const auto positions = model.node_positions(model.sample_index(sample));
    for (std::size_t i = 0; i < mesh.size(); ++i) mesh[i] += weight * positions[i];
  }
  return mesh;
}

/// mean_distance() of the sample with the least one.
inline double nearest_sample(const Model& model, std::span<const float> mesh) {
  double least = std::numeric_limits<double>::infinity();
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    least = std::min(least, mean_distance(mesh, model.node_positions(s)));
  return least;
}

}  // namespace lbea::test
