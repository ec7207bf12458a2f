// Runs in which the component travels and turns, without this motion.
#include "precompute/bake.hpp"
#include "precompute/mapping/body_frame.hpp"
#include "tests/mapping/meshes.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr std::uint32_t state_count = 4;
const Eigen::Vector3d center{95, 45, 0};

/// In the last state: 150, -20, 8 length units and 12 degrees about an axis through the undeformed plate's center.
Eigen::Isometry3d travel(std::uint32_t step) {
  const double share = static_cast<double>(step) / (state_count - 1);
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() =
      Eigen::AngleAxisd(share * 12 * std::numbers::pi / 180, Eigen::Vector3d(1, 2, 2).normalized()).matrix();
  motion.translation() = center + share * Eigen::Vector3d(150, -20, 8) - motion.linear() * center;
  return motion;
}

SyntheticSimulation plate(const SimulationMesh& mesh, double angle, bool travels) {
  std::vector<SimulationState> states;
  for (std::uint32_t step = 0; step < state_count; ++step) {
    states.push_back(bent_state(mesh, 0.0005 * step, angle * step / (state_count - 1), 190));
    if (!travels) continue;
    for (std::size_t n = 0; n < mesh.nodes(); ++n) {
      Eigen::Map<Eigen::Vector3f> position(&states.back().positions[3 * n]);
      position = (travel(step) * position.cast<double>()).cast<float>();
    }
  }
  return {mesh, std::move(states), {{"plastic_strain", "1"}}};
}

std::unique_ptr<SimulationReader> fixed(const SyntheticSimulation& run, std::vector<std::uint32_t> nodes = {},
                                        const SimulationMesh& reference = plate_mesh(coarse)) {
  BodyFrame frame([reference] { return std::make_unique<SyntheticSimulation>(plate(reference, 1, true)); },
                  {true, std::move(nodes)});
  return frame.fixed(std::make_unique<SyntheticSimulation>(run), "run_1");
}

std::vector<float> positions_of(SimulationReader& run, std::uint32_t step) {
  SimulationState state;
  run.read(step, state);
  return state.positions;
}

}  // namespace

TEST_CASE("what is left of a run does not depend on its rigid motion") {
  const SimulationMesh mesh = plate_mesh(coarse);
  for (const std::vector<std::uint32_t>& nodes :
       {std::vector<std::uint32_t>{}, {mesh.node_ids[0], mesh.node_ids[19], mesh.node_ids[199]}}) {
    const auto travelling = fixed(plate(mesh, 1, true), nodes), resting = fixed(plate(mesh, 1, false), nodes);
    for (std::uint32_t step = 0; step < state_count; ++step)
      CHECK(largest_difference(positions_of(*travelling, step), positions_of(*resting, step)) < 1e-3);  // rounding
  }
}

TEST_CASE("an undeformed plate stays where it is, and its motion is known") {
  const SimulationMesh mesh = plate_mesh(coarse);
  const auto run = fixed(plate(mesh, 0, true));
  const std::vector<SimulationHistory> histories = run->histories();
  REQUIRE(histories.size() == 4);
  CHECK(histories[0].name == "rigid_x");
  CHECK(histories[3].name == "rigid_turn");
  for (const std::uint32_t step : {3u, 0u, 2u}) {  // also of states that were not read
    const double share = step / 3.0;
    const std::array expected{150 * share, -20 * share, 8 * share, 12 * share};
    for (std::uint32_t i = 0; i < 4; ++i) CHECK(std::abs(run->history(step, i) - expected[i]) < 1e-3);
    CHECK(largest_difference(positions_of(*run, step), mesh.positions) < 1e-3);
  }
}

// A solver's wall force of 0 was not reported.
TEST_CASE("of the histories that begin like the motion's, only these are the motion's") {
  CHECK(is_rigid_motion("rigid_turn"));
  CHECK_FALSE(is_rigid_motion("rigid_wall_force"));
}

TEST_CASE("the plate lies nearest to its undeformed shape of all poses") {
  const SimulationMesh mesh = plate_mesh(coarse);
  const std::vector<float> positions = positions_of(*fixed(plate(mesh, 1, true), mesh.node_ids), 3);
  const auto squares = [&](const Eigen::Isometry3d& motion) {
    double sum = 0;
    for (std::size_t n = 0; n < mesh.nodes(); ++n) {
      const auto at = [n](const std::vector<float>& of) {
        return Eigen::Map<const Eigen::Vector3f>(&of[3 * n]).cast<double>().eval();
      };
      sum += (motion * at(positions) - at(mesh.positions)).squaredNorm();
    }
    return sum;
  };
  const double least = squares(Eigen::Isometry3d::Identity());
  for (int axis = 0; axis < 3; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Eigen::Isometry3d shifted = Eigen::Isometry3d::Identity(), turned = shifted;
      shifted.translation()[axis] = 0.1 * sign;
      turned.linear() = Eigen::AngleAxisd(1e-3 * sign, Eigen::Vector3d::Unit(axis)).matrix();
      turned.translation() = center - turned.linear() * center;
      CHECK(squares(shifted) > least);
      CHECK(squares(turned) > least);
    }
}

TEST_CASE("elements of different size do not pull the frame towards the small ones") {
  SimulationMesh mesh = plate_mesh(coarse);
  for (std::size_t n = 0; n < mesh.nodes(); ++n) {  // dense at one end
    float& x = mesh.positions[3 * n];
    x = x * x / 190;
  }
  // The mean of z over the area of the undeformed plate is 0 in the body frame, as that of its nodes is not.
  const auto run = fixed(plate(mesh, 1, true), {}, mesh);
  const std::vector<float> positions = positions_of(*run, 3);
  double by_area = 0, by_nodes = 0;
  for (const Quad& element : mesh.elements) {
    const double width = double{mesh.positions[3 * element[1]]} - double{mesh.positions[3 * element[0]]} +
                         double{mesh.positions[3 * element[2]]} - double{mesh.positions[3 * element[3]]};
    for (const std::uint32_t node : element) by_area += std::abs(width) * double{positions[3 * node + 2]};
  }
  for (std::size_t n = 0; n < mesh.nodes(); ++n) by_nodes += double{positions[3 * n + 2]};
  CHECK(std::abs(by_area) < 1e-2);
  CHECK(std::abs(by_nodes) > 10);
}

TEST_CASE("nodes that cannot give a frame are refused") {
  const SimulationMesh mesh = plate_mesh(coarse);
  const SyntheticSimulation run = plate(mesh, 1, true);
  const auto& ids = mesh.node_ids;
  check_error(error_of([&] { fixed(run, {ids[0], ids[1], 999'999}); }), Status::bad_config, {"no node 999999"});
  check_error(error_of([&] { fixed(run, {ids[0], ids[1], ids[2]}); }), Status::bad_config, {"on a line"});
  check_error(error_of([&] {
                fixed(run, {ids[0], ids[19], ids[0]});
              }),
              Status::bad_config, {"node " + std::to_string(ids[0]), "twice"});
  const SyntheticSimulation other = plate(renumbered(mesh), 1, true);
  for (const std::vector<std::uint32_t>& nodes : {std::vector<std::uint32_t>{}, {ids[0], ids[19], ids[199]}})
    check_error(error_of([&] { fixed(other, nodes); }), Status::bad_input, {"run_1", "reference run's"});
}

TEST_CASE("nodes that move onto a line do not roll the component") {
  const SimulationMesh mesh = plate_mesh(coarse);
  std::vector<SimulationState> states{bent_state(mesh, 0, 0, 190), bent_state(mesh, 0.0005, 0, 190)};
  states[1].positions[3 * 199 + 1] = 0;  // onto the edge y = 0
  const SyntheticSimulation run{mesh, states, {{"plastic_strain", "1"}}};
  const auto by_nodes = fixed(run, {mesh.node_ids[0], mesh.node_ids[19], mesh.node_ids[199]});
  (void)positions_of(*by_nodes, 0);
  check_error(error_of([&] { (void)positions_of(*by_nodes, 1); }), Status::bad_input,
              {"on a line", "state 1", "run_1"});
}

TEST_CASE("eroded elements do not move the frame, unless they leave a named node without position") {
  const SimulationMesh mesh = plate_mesh(coarse);
  std::vector<SimulationState> states{bent_state(mesh, 0, 0, 190), bent_state(mesh, 0.0005, 0, 190)};
  for (std::size_t e = 0; e < mesh.elements.size(); ++e)
    if (std::ranges::find(mesh.elements[e], 0u) != mesh.elements[e].end()) states[1].alive[e] = 0;
  states[1].positions[0] = 1e6f;  // flies away
  const SyntheticSimulation run{mesh, states, {{"plastic_strain", "1"}}};
  const std::vector<float> positions = positions_of(*fixed(run), 1);
  for (std::size_t i = 3; i < positions.size(); ++i) CHECK(std::abs(positions[i] - mesh.positions[i]) < 1e-3f);
  const auto by_nodes = fixed(run, {mesh.node_ids[0], mesh.node_ids[19], mesh.node_ids[199]});
  check_error(error_of([&] { positions_of(*by_nodes, 1); }), Status::bad_input,
              {"node " + std::to_string(mesh.node_ids[0]), "state 1", "run_1"});
}

TEST_CASE("a model of travelling runs has the samples of resting ones, and channels of their motion") {
  const SimulationMesh mesh = plate_mesh(coarse);
  const auto bake = [&](bool travels, const std::filesystem::path& file) {
    Ensemble ensemble;
    for (const double angle : {0.5, 1.0, 1.5}) {
      const SyntheticSimulation run = plate(angle == 1.0 ? renumbered(mesh) : mesh, angle, travels);
      const std::string name = std::to_string(angle);
      ensemble.runs.push_back({name, {}, [run] { return std::make_unique<SyntheticSimulation>(run); }, name});
    }
    EnsembleDescription description;
    description.modes = 10;
    description.rigid.are_set = true;
    bake_model(ensemble, description, file);
    return Model::open(file);
  };
  const TemporaryFolder folder;
  const Model travelling = bake(true, folder / "a.lbea"), resting = bake(false, folder / "b.lbea");
  REQUIRE(travelling.samples() == 3 * state_count);
  for (std::uint32_t s = 0; s < travelling.samples(); ++s) {
    const auto a = travelling.node_positions(s), b = resting.node_positions(s);
    CHECK(largest_difference({a.begin(), a.end()}, {b.begin(), b.end()}) < 1e-3);
  }
  REQUIRE(travelling.channels() == 4);
  CHECK(travelling.channel(0).name == "rigid_x");
  CHECK(travelling.channel(0).unit == "mm");
  CHECK(travelling.channel(3).unit == "deg");
}
