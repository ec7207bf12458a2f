// lbea-register: where does the rig stand? Refines a rough pose from clouds of the undeformed component.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "tools/register/undeformed.hpp"
#include "tools/shared/cli/cloud_files.hpp"
#include "tools/shared/cli/tool.hpp"

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
  std::uint32_t frames = 3;
  std::optional<double> noise;
  bake::RegistrationSettings settings;
  bool even_if_ambiguous = false, json = false;
};

void declare(Tool& tool, Arguments& arguments) {
  tool.add_option("MODEL", arguments.model, "a model of the component (.lbea) that begins before it deforms")
      ->required();
  tool.add_option("CLOUDS", arguments.clouds,
                  "clouds of the undeformed component, or a folder of clouds: its first ones")
      ->required();
  tool.add_option("--sensor", arguments.sensor, "sensor.json with the rough pose")->required();
  tool.add_option("-o,--out", arguments.out, "the refined sensor.json")->required();
  tool.add_option("--frames", arguments.frames, "how many clouds, from the first on")->check(positive_number());
  tool.add_option("--noise", arguments.noise, "standard deviation of a point (default: sensor.json's)")
      ->check(positive_number());
  tool.add_option("--rough-shift", arguments.settings.rough_shift, "how far off the rough pose may be, length unit")
      ->check(positive_number());
  tool.add_option("--rough-turn", arguments.settings.rough_turn_deg, "and turned, degrees")->check(positive_number());
  tool.add_option("--tolerance", arguments.settings.tolerance,
                  "poses that move the component by less are the same, length unit")
      ->check(positive_number());
  tool.add_flag("--even-if-ambiguous", arguments.even_if_ambiguous,
                "write the pose although the clouds do not settle it");
  tool.add_flag("--json", arguments.json, "print the summary as JSON");
}

std::vector<Point> read_clouds(const Arguments& arguments) {
  auto files = find_clouds(arguments.clouds);
  files.resize(std::min<std::size_t>(files.size(), arguments.frames));
  std::vector<Point> points;
  for (const auto& file : files) {
    const io::PointCloud cloud = io::read_point_cloud(file);
    points.insert(points.end(), cloud.points.begin(), cloud.points.end());
  }
  return points;
}

void check_units(const std::vector<Point>& points, const Undeformed& component, const std::string& unit) {
  const double cloud = bake::robust_diagonal(points), mesh = bake::box_diagonal(component.shape.mean);
  const auto factor = bake::unit_factor(cloud, mesh);
  if (!factor) return;
  char text[300];
  std::snprintf(text, sizeof text,
                "the clouds measure %.4g across and the component %.4g %s: the units disagree; multiply the clouds by "
                "%g, or correct the "
                "ensemble's length_unit",
                cloud, mesh, unit.c_str(), *factor);
  throw Error(Status::bad_input, text);
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
  std::printf("residual       %.3f, of %.1f %% of the points\n", r.residual, 100 * r.counted);
  std::printf("starts         %.0f %% ended at this pose\n", 100 * r.agreeing);
  std::printf("least certain  to %.3f, along (%.2f, %.2f, %.2f)\n", least.deviation, least.shift[0], least.shift[1],
              least.shift[2]);
}

int run(Arguments& arguments) {
  const io::SensorDescription rough = io::read_sensor_json(arguments.sensor);
  arguments.settings.noise = arguments.noise.value_or(std::max(double{rough.noise.sigma}, 1e-6));
  const Model model = Model::open(arguments.model);
  const Undeformed component = undeformed_component(model, arguments.settings.noise);
  const auto points = read_clouds(arguments);
  check_units(points, component, std::string(model.length_unit()));
  const bake::ReferenceSurface surface{component.shape.mean, component.elements, component.shape.modes,
                                       visibility_of(component, rough)};
  const bake::Registration result =
      bake::register_cloud(surface, points, rough.sensor.T_reference_sensor, arguments.settings);
  print(result, arguments.json);
  if (result.ambiguous()) {
    std::fprintf(stderr, "lbea-register: ambiguous: %s\n", result.doubt.c_str());
    if (!arguments.even_if_ambiguous) {
      std::fprintf(stderr, "lbea-register: no pose written; --even-if-ambiguous writes it\n");
      return exit_failed;
    }
  }
  io::AtomicFile file(arguments.out);
  file.write(with_poses(arguments.sensor, moved_to(rough.sensor, result.T_reference_sensor)));
  file.commit();
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
