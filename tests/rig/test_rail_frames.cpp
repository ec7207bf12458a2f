// Against clouds of the same rig and runs by an independent implementation.
#include "adapters/clouds/point_cloud.hpp"
#include "adapters/rig/sensor_json.hpp"
#include "adapters/simulation/open.hpp"
#include "precompute/rig/virtual_sensor.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <set>
#include <string>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;

namespace {

/// Points sorted by x, which bounds the search for the nearest one.
class Cloud {
 public:
  explicit Cloud(std::vector<Point> points) : points_(std::move(points)) {
    std::sort(points_.begin(), points_.end(), [](const Point& a, const Point& b) { return a.x < b.x; });
  }
  [[nodiscard]] const std::vector<Point>& points() const { return points_; }
  [[nodiscard]] double distance(const Point& from) const {
    const auto middle = std::lower_bound(points_.begin(), points_.end(), from.x,
                                         [](const Point& point, float x) { return point.x < x; });
    double nearest = 1e9;
    for (auto to = middle; to != points_.end() && to->x - from.x < nearest; ++to) update(nearest, from, *to);
    for (auto to = middle; to != points_.begin() && from.x - (to - 1)->x < nearest; --to)
      update(nearest, from, *(to - 1));
    return nearest;
  }

 private:
  static void update(double& nearest, const Point& a, const Point& b) {
    nearest = std::min(nearest, static_cast<double>(std::hypot(a.x - b.x, a.y - b.y, a.z - b.z)));
  }
  std::vector<Point> points_;
};

struct Distances {
  double median, p99, far;  // far: share beyond 2 mm
};

Distances distances(const Cloud& from, const Cloud& to) {
  std::vector<double> all;
  for (std::size_t i = 0; i < from.points().size(); i += 7) all.push_back(to.distance(from.points()[i]));
  std::sort(all.begin(), all.end());
  const auto far = static_cast<double>(all.end() - std::upper_bound(all.begin(), all.end(), 2.0));
  return {all[all.size() / 2], all[all.size() * 99 / 100], far / static_cast<double>(all.size())};
}

/// Two noisy measurements in one pixel differ by a normal number of sqrt(2) sigma; with pixels 0.7 mm apart the
/// nearest point is nearly always the one in the same pixel.
void check_noise_apart(const Distances& found, const SensingNoise& noise) {
  const double spread = std::sqrt(2.0) * noise.sigma;
  CHECK(found.median == doctest::Approx(0.6745 * spread).epsilon(0.06));
  CHECK(found.p99 == doctest::Approx(2.576 * spread).epsilon(0.15));  // outliers raise it a little
  CHECK(found.far < 2.5 * noise.outliers);
}

}  // namespace

TEST_CASE("the rail's frames: as many points as the independent sensor's, and on the same surface") {
  const auto rail = test::reference_data() / "rail";
  const auto description = read_sensor_json(rail / "sensor.json");
  for (const std::string run : {"run_013", "run_060"}) {
    const auto reader = open_simulation(rail / "runs" / run);
    const VirtualSensor sensor(description.sensor, reader->mesh().nodes(), reader->mesh().elements);
    SimulationState state;
    for (const std::uint32_t step : {2u, 14u, 30u}) {
      CAPTURE(run);
      CAPTURE(step);
      reader->read(step, state);
      const Cloud ours(sensor.sense({state.positions, state.alive}, description.noise, step));
      const std::string name = run + (step < 10 ? "_step0" : "_step") + std::to_string(step) + ".ply";
      const PointCloud file = read_point_cloud(rail / "frames" / name);
      const Cloud theirs(file.points);
      const auto wanted = static_cast<double>(theirs.points().size());
      const auto count = static_cast<double>(ours.points().size());
      CHECK(std::abs(count / wanted - 1) < 0.001);  // a pixel at an edge falls to either side
      check_noise_apart(distances(ours, theirs), description.noise);
      check_noise_apart(distances(theirs, ours), description.noise);
    }
  }
}

TEST_CASE("the nodes that the rig sees at impact are the reference's region") {
  const auto rail = test::reference_data() / "rail";
  std::ifstream file(rail / "reference" / "nodes.txt");
  const std::set<std::uint32_t> region{std::istream_iterator<std::uint32_t>(file), {}};
  REQUIRE(region.size() > 1000);
  const auto reader = open_simulation(rail / "runs" / "run_015");
  const SimulationMesh& mesh = reader->mesh();
  SimulationState state;
  reader->read(0, state);
  const VirtualSensor sensor(read_sensor_json(rail / "sensor.json").sensor, mesh.nodes(), mesh.elements);
  const auto visible = sensor.visible_nodes({state.positions, state.alive});
  std::set<std::uint32_t> seen;
  for (std::size_t node = 0; node < mesh.nodes(); ++node)
    if (visible[node] != 0) seen.insert(mesh.node_ids[node]);
  CHECK(seen == region);
}
