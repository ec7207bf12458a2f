// lbea-register: refines the rough pose of a rig from clouds of the undeformed component.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "precompute/registration/alignment.hpp"
#include "precompute/registration/registration.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/tool.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <optional>

namespace {

using namespace lbea;
using namespace lbea::tool;

struct Arguments {
  std::filesystem::path model, sensor, out;
  std::vector<std::string> clouds;
  std::string columns;
  std::uint32_t frames = 3;
  std::optional<double> noise, rough_shift, tolerance;
  bake::RegistrationSettings settings;
  bool even_if_ambiguous = false, json = false;
};

void declare(Tool& tool, Arguments& arguments) {
  tool.add_option("MODEL", arguments.model, "a model of the component (.lbea) whose first samples are undeformed")
      ->required();
  tool.add_option("CLOUDS", arguments.clouds,
                  "clouds of the undeformed component, or a folder of clouds, of which the first are used")
      ->required();
  tool.add_option("--sensor", arguments.sensor, "sensor.json with the rough pose")->required();
  tool.add_option("-o,--out", arguments.out, "the refined sensor.json")->required();
  add_columns_option(tool, arguments.columns);
  tool.add_option("--frames", arguments.frames, "number of clouds to use, from the first")->check(positive_number());
  tool.add_option("--noise", arguments.noise, "standard deviation of a point (default: sensor.json's)")
      ->check(positive_number());
  tool.add_option("--rough-shift", arguments.rough_shift,
                  "largest shift between the rough and the true pose, length unit (default: 20 mm)")
      ->check(positive_number());
  tool.add_option("--rough-turn", arguments.settings.rough_turn_deg,
                  "largest rotation between the rough and the true pose, degrees")
      ->check(positive_number());
  tool.add_option("--tolerance", arguments.tolerance,
                  "poses that differ by less count as equal; largest displacement of the component, length unit "
                  "(default: 1 mm)")
      ->check(positive_number());
  tool.add_flag("--even-if-ambiguous", arguments.even_if_ambiguous,
                "write the pose although the clouds do not determine it");
  tool.add_flag("--json", arguments.json, "print the summary as JSON");
}

/// The component before the impact, from a model.
struct Undeformed {
  bake::ShapeModes shape;  // of the earliest sample of every simulation, which differ by the parameters
  std::vector<std::array<std::uint32_t, 4>> elements;
};

/// least_variation: modes that move the nodes by less are left out, length unit.
Undeformed undeformed_component(const Model& model, double least_variation) {
  double earliest = std::numeric_limits<double>::infinity();
  for (std::uint32_t s = 0; s < model.samples(); ++s) earliest = std::min(earliest, model.sample_time_s(s));
  std::vector<std::span<const float>> shapes;
  std::vector<std::uint32_t> samples;
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    if (model.sample_time_s(s) <= earliest) {
      samples.push_back(s);
      shapes.push_back(model.node_positions(s));
    }
  const std::vector<std::uint8_t> present = present_in_all(model, samples);
  Undeformed component{bake::shape_modes(shapes, least_variation), {}};
  component.elements.resize(model.elements());
  for (std::size_t i = 0; i < model.element_nodes().size(); ++i)
    component.elements[i / 4][i % 4] = model.element_nodes()[i];
  for (std::size_t e = 0; e < present.size(); ++e)
    if (present[e] == 0) component.elements[e].fill(component.elements[e][0]);  // without area
  return component;
}

/// The rig with its left camera at the pose and the same relative pose of its right camera.
bake::StereoSensor moved_to(const bake::StereoSensor& rig, const RigidTransform& T_reference_sensor) {
  bake::StereoSensor moved = rig;
  const Eigen::Isometry3d T_sensor_right =
      bake::to_isometry(rig.T_reference_sensor).inverse() * bake::to_isometry(rig.T_reference_right);
  moved.T_reference_sensor = T_reference_sensor;
  moved.T_reference_right = bake::to_transform(bake::to_isometry(T_reference_sensor) * T_sensor_right);
  return moved;
}

/// Computes the elements that the rig sees from another pose. `rig`: the relative pose of its cameras is used.
decltype(bake::ReferenceSurface::visible) visibility_of(const Undeformed& component, const io::SensorDescription& rig) {
  return [&component, rig](const RigidTransform& pose) {
    const bake::VirtualSensor sensor(moved_to(rig.sensor, pose), component.shape.mean.size() / 3, component.elements);
    return sensor.visible_elements({component.shape.mean}, rig.noise.min_cos_incidence);
  };
}

nlohmann::ordered_json rows(const RigidTransform& T) {
  auto rows = nlohmann::ordered_json::array();
  for (std::size_t i = 0; i < 3; ++i)
    rows.push_back({double{T[4 * i]}, double{T[4 * i + 1]}, double{T[4 * i + 2]}, double{T[4 * i + 3]}});
  return rows;
}

/// The text of a sensor.json with both poses replaced by those of the rig; the rest is unchanged.
std::string with_poses(const std::filesystem::path& sensor_json, const bake::StereoSensor& rig) {
  const auto bytes = io::read_file(sensor_json);
  auto json = nlohmann::ordered_json::parse(io::as_text(bytes));
  json["T_reference_sensor"] = rows(rig.T_reference_sensor);
  json["sensor"]["T_reference_right"] = rows(rig.T_reference_right);
  return json.dump(1) + '\n';
}

/// Only a sensor.json is overwritten.
void check_output(const std::filesystem::path& file) {
  if (!std::filesystem::exists(file)) return;
  try {
    if (std::filesystem::is_regular_file(file)) return void(io::read_pose(file));
  } catch (const Error&) {  // another format
  }
  throw Error(Status::write_failed,
              file.string() + ": exists and is not a sensor.json; nothing was overwritten, choose another name");
}

std::vector<Point> read_clouds(const Arguments& arguments) {
  auto files = find_clouds(arguments.clouds);
  files.resize(std::min<std::size_t>(files.size(), arguments.frames));
  std::vector<Point> points;
  for (const auto& file : files) {
    const io::PointCloud cloud = io::read_point_cloud(file, arguments.columns);
    points.insert(points.end(), cloud.points.begin(), cloud.points.end());
  }
  return points;
}

void check_units(const std::vector<Point>& points, const Undeformed& component, const std::string& unit) {
  const double cloud = bake::robust_diagonal(points), mesh = bake::box_diagonal(component.shape.mean);
  const auto factor = bake::unit_factor(cloud, mesh);
  if (!factor) return;
  if (const auto far = bake::far_points(points); !far.empty())
    throw Error(Status::bad_input,
                formatted("%zu of %zu points are far from all others, for instance (%.4g, %.4g, %.4g); remove them, "
                          "and numbers that stand for missing values",
                          far.size(), points.size(), static_cast<double>(far[0].x), static_cast<double>(far[0].y),
                          static_cast<double>(far[0].z)));
  throw Error(
      Status::bad_input,
      formatted("the clouds measure %.4g across and the component %.4g %s: the units disagree; multiply the clouds by "
                "%g, or correct the ensemble's length_unit",
                cloud, mesh, unit.c_str(), *factor));
}

void print(const bake::Registration& r, bool json) {
  const bake::LeastCertain& least = r.least_certain;
  if (json) {
    const nlohmann::ordered_json summary{{"T_reference_sensor", r.T_reference_sensor},
                                         {"residual", r.residual},
                                         {"counted", r.counted},
                                         {"shift", r.shift},
                                         {"turn_deg", r.turn_deg},
                                         {"agreeing_starts", r.agreeing},
                                         {"least_certain",
                                          {{"sensitivity", least.sensitivity},
                                           {"deviation", least.deviation},
                                           {"shift", least.shift},
                                           {"turn", least.turn}}},
                                         {"ambiguous", r.ambiguous()},
                                         {"doubt", r.doubt}};
    std::printf("%s\n", summary.dump(2).c_str());
    return;
  }
  std::printf("moved          %.3f, turned by %.3f degrees\n", r.shift, r.turn_deg);
  std::printf("residual       %.3f, over %.1f %% of the points\n", r.residual, 100 * r.counted);
  std::printf("starts         %.0f %% converged to this pose\n", 100 * r.agreeing);
  std::printf("least certain  within %.3f, along (%.2f, %.2f, %.2f)\n", least.deviation, least.shift[0], least.shift[1],
              least.shift[2]);
}

int run(Arguments& arguments) {
  check_output(arguments.out);
  const Model model = Model::open(arguments.model);
  const io::SensorDescription rough = io::read_sensor_json(arguments.sensor, model.length_unit());
  bake::RegistrationSettings& settings = arguments.settings;
  const double mm = units_per_mm(model.length_unit());
  settings.noise = arguments.noise.value_or(std::max(double{rough.noise.sigma}, 1e-6 * mm));
  settings.rough_shift = arguments.rough_shift.value_or(settings.rough_shift * mm);
  settings.tolerance = arguments.tolerance.value_or(settings.tolerance * mm);
  const Undeformed component = undeformed_component(model, arguments.settings.noise);
  const auto points = read_clouds(arguments);
  check_units(points, component, std::string(model.length_unit()));
  const bake::ReferenceSurface surface{component.shape.mean, component.elements, component.shape.modes,
                                       visibility_of(component, rough)};
  const bake::Registration result =
      bake::register_cloud(surface, points, rough.sensor.T_reference_sensor, arguments.settings);
  print(result, arguments.json);
  for (const std::string& doubt : {bake::beyond_range(result, settings), bake::unexplained_points(result)})
    if (!doubt.empty()) std::fprintf(stderr, "lbea-register: warning: %s\n", doubt.c_str());
  if (result.ambiguous()) {
    std::fprintf(stderr, "lbea-register: ambiguous: %s\n", result.doubt.c_str());
    if (!arguments.even_if_ambiguous) {
      std::fprintf(stderr, "lbea-register: no pose written; --even-if-ambiguous writes it\n");
      return exit_failed;
    }
  }
  io::write_file(arguments.out, with_poses(arguments.sensor, moved_to(rough.sensor, result.T_reference_sensor)));
  return exit_ok;
}

}  // namespace

int main(int argc, char** argv) {
  Tool tool("lbea-register", "Refines a rough T_reference_sensor from clouds of the undeformed component.",
            "lbea-register rail.lbea frames/ --sensor rough.json --out sensor.json");
  Arguments arguments;
  declare(tool, arguments);
  return tool.run(argc, argv, [&] { return run(arguments); });
}
