// match.cpp - find the simulation that matches a cloud, in C++, without ZeroMQ.
//   c++ -std=c++20 match.cpp $(pkg-config --cflags --libs lbea-rig) -o match
//   ./match rail.lbea sensor.json fit < cloud.xyz      (without fit, by lbea: no verdict)
#include <lbea/lbea.hpp>
#include <lbea/rig/sensor_json.hpp>

#include <iostream>
#include <string_view>
#include <vector>

void grab(std::vector<lbea::Point>& points) {  // replace by your camera; reads lines of x y z
  points.clear();
  for (lbea::Point p; std::cin >> p.x >> p.y >> p.z;) points.push_back(p);
}

int main(int argc, char** argv) try {
  const lbea::Model model = lbea::Model::open(argc > 1 ? argv[1] : "rail.lbea");
  const lbea::RigidTransform pose = argc > 2 ? lbea::io::read_pose(argv[2]) : lbea::identity_transform;
  const bool is_fit = argc > 3 && std::string_view(argv[3]) == "fit";
  const lbea::Method method = is_fit ? lbea::Method::fit : lbea::Method::lbea;
  lbea::Matcher matcher{model, {.max_matches = 3, .method = method, .T_reference_sensor = pose}};
  std::vector<lbea::Point> points;

  grab(points);
  const lbea::MatchResult result = matcher.match({.id = 1, .points = points});  // no allocation, no lock, no exception
  std::cout << to_string(result.status) << ", " << 100 * result.coverage
            << " % of the surface seen, verdict: " << to_string(result.verdict) << '\n';
  for (const lbea::Match& match : result.matches)
    std::cout << model.simulation_name(match.sample.simulation) << " at "
              << model.sample_time_s(model.sample_index(match.sample)) << " s, distance " << match.distance << '\n';
  return result.status == lbea::Status::ok ? 0 : 1;
} catch (const lbea::Error& error) {
  std::cerr << error.what() << '\n';
  return 1;
}
