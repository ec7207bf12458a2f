// Positions of nodes that no element has: those of the surface, continued.
#include "precompute/jobs/jobs.hpp"
#include "precompute/survey/surface_continuation.hpp"
#include "tests/precompute/survey/eroding_model.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// Per node, the nodes beside it along the sides of elements, each as often as it is.
std::map<std::uint32_t, std::vector<std::uint32_t>> neighbors_in(const SimulationMesh& mesh) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> neighbors;
  for (const Quad& q : mesh.elements)
    for (std::size_t i = 0; i < 4; ++i) {
      neighbors[q[i]].push_back(q[(i + 1) % 4]);
      neighbors[q[(i + 1) % 4]].push_back(q[i]);
    }
  return neighbors;
}

/// Without any other run.
CommonMesh common_mesh_of(const SimulationMesh& mesh) {
  return {mesh.node_ids, mesh.elements, mesh.element_ids, mesh.element_parts};
}

void continue_surface(const SimulationMesh& mesh, SimulationState& state, const SimulationMesh* reference = nullptr) {
  const CommonMesh common = common_mesh_of(mesh);
  SurfaceContinuation(mesh, common, map_common(common, mesh, "a"), reference).apply(state);
}

}  // namespace

TEST_CASE("the displacement of a free node is the mean of its neighbors', others stay bit for bit") {
  const SimulationMesh mesh = plate_mesh();
  SimulationState state = bent_state(mesh, 0, 1.2, 190);
  erode_patch(state);
  const std::vector<float> before = state.positions;
  continue_surface(mesh, state);
  const auto neighbors = neighbors_in(mesh);
  const auto moved = [&](std::size_t node, std::size_t axis) {
    return double{state.positions[3 * node + axis]} - double{mesh.positions[3 * node + axis]};
  };
  for (std::uint32_t node = 0; node < mesh.nodes(); ++node)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      if (!is_in(patch_nodes(), node)) {
        REQUIRE(state.positions[3 * node + axis] == before[3 * node + axis]);
        continue;
      }
      double sum = 0;
      for (const std::uint32_t neighbor : neighbors.at(node)) sum += moved(neighbor, axis);
      // Positions of up to 190 mm are rounded by up to 190 * 2^-24.
      CHECK(moved(node, axis) ==
            doctest::Approx(sum / static_cast<double>(neighbors.at(node).size())).scale(1).epsilon(3e-5));
    }
}

TEST_CASE("nodes without any connection to a living one move with the mean of those that live") {
  SimulationMesh mesh = plate_mesh({8, 5, 70, 40});
  const auto nodes = static_cast<std::uint32_t>(mesh.nodes());
  for (const float x : {200.0f, 210.0f})
    for (const float y : {0.0f, 10.0f}) mesh.positions.insert(mesh.positions.end(), {x, y, 0});
  for (std::uint32_t i = 0; i < 4; ++i) mesh.node_ids.push_back(5000 + i);
  mesh.elements.push_back({nodes, nodes + 2, nodes + 3, nodes + 1});
  mesh.element_ids.push_back(9000);
  mesh.element_parts.push_back(9);
  SimulationState state = bent_state(mesh, 0, 0, 70);
  for (std::size_t i = 0; i < mesh.nodes(); ++i) state.positions[3 * i + 1] += i < nodes ? 7.0f : 500.0f;
  const std::vector<float> apart = state.positions;
  const CommonMesh common = common_mesh_of(mesh);
  SurfaceContinuation continuation(mesh, common, map_common(common, mesh, "a"));
  continuation.apply(state);
  CHECK(state.positions == apart);  // nothing erodes
  state.alive.back() = 0;
  continuation.apply(state);
  for (std::size_t i = 0; i < mesh.nodes(); ++i) CHECK(state.positions[3 * i + 1] == mesh.positions[3 * i + 1] + 7);
}

TEST_CASE("free nodes that the common mesh lacks stay as they are") {
  const SimulationMesh mesh = plate_mesh();
  SimulationState state = bent_state(mesh, 0, 1.2, 190);
  erode_patch(state);
  const std::vector<float> before = state.positions;
  CommonMeshBuilder builder(mesh, "a");
  std::vector<Presence> present(mesh.elements.size(), Presence::always);
  const auto middle = static_cast<std::uint32_t>(patch_nodes()[4]);
  for (std::size_t e = 0; e < present.size(); ++e)
    if (std::ranges::find(mesh.elements[e], middle) != mesh.elements[e].end()) present[e] = Presence::missing;
  builder.keep(present, "a");
  const CommonMesh common = builder.finish();
  SurfaceContinuation(mesh, common, map_common(common, mesh, "a")).apply(state);
  for (const std::size_t node : patch_nodes())
    CHECK((state.positions[3 * node + 2] == before[3 * node + 2]) == (node == middle));
}

TEST_CASE("positions of free nodes may be any number or none; those of others may not") {
  const auto with = [](std::size_t node, float value) {
    Ensemble ensemble = eroding_plates(1, steps, from);
    ensemble.runs[1].open = [=] {
      SyntheticSimulation plate = eroding_plate(0.5, steps, from);
      std::vector<SimulationState> states(steps);
      for (std::uint32_t step = 0; step < steps; ++step) plate.read(step, states[step]);
      for (std::uint32_t step = from; step < steps; ++step) std::fill_n(&states[step].positions[3 * node], 3, value);
      return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields());
    };
    return ensemble;
  };
  const auto baked = [&](const Ensemble& ensemble) {
    const TemporaryFolder folder;
    bake_model(ensemble, bent_plates_description(), folder / "m.lbea", with_views());
    return AlignedBytes(folder / "m.lbea");
  };
  const AlignedBytes expected_bytes = baked(eroding_plates(1, steps, from));
  const Model expected = Model::view(expected_bytes.span());
  const float nan = std::numeric_limits<float>::quiet_NaN(), infinity = std::numeric_limits<float>::infinity();
  for (const float value : {nan, infinity, 1e30f}) {
    const AlignedBytes bytes = baked(with(patch_nodes()[4], value));
    const Model model = Model::view(bytes.span());
    for (std::uint32_t s = 0; s < model.samples(); ++s)
      CHECK(std::ranges::equal(model.node_positions(s), expected.node_positions(s)));
    check_error(error_of([&] { (void)baked(with(0, value)); }), Status::bad_input, {"run eroding_0, state 4", "node"});
  }
}

TEST_CASE("undeformed places that a run lacks are the reference run's, or else continue those around") {
  SimulationMesh mesh = plate_mesh();
  const std::vector<float> flat = mesh.positions;
  for (const std::size_t node : patch_nodes()) mesh.positions[3 * node + 2] += 3;  // a bead
  SimulationMesh reference = mesh, lacking = mesh;
  for (std::size_t i = 0; i < reference.positions.size(); i += 3) reference.positions[i] += 20;  // starts elsewhere
  lacking.guessed.assign(mesh.nodes(), 0);
  for (const std::size_t node : patch_nodes()) lacking.guessed[node] = 1, lacking.positions[3 * node] = 500;
  SimulationMesh lacking_reference = reference;
  lacking_reference.guessed = lacking.guessed;
  const auto check = [&](const SimulationMesh* other, const std::vector<float>& places) {
    SimulationState state = bent_state(mesh, 0, 0, 190);
    for (std::size_t i = 1; i < state.positions.size(); i += 3) state.positions[i] += 7;
    erode_patch(state);
    continue_surface(lacking, state, other);
    for (std::size_t i = 0; i < state.positions.size(); ++i)  // of up to 210 mm, rounded three times by 210 * 2^-24
      CHECK(state.positions[i] == doctest::Approx(places[i] + (i % 3 == 1 ? 7 : 0)).scale(1).epsilon(1e-4));
  };
  check(&reference, mesh.positions);
  for (const SimulationMesh* other : {static_cast<const SimulationMesh*>(nullptr), &std::as_const(lacking)})
    check(other, flat);  // linear coordinates on a regular grid are harmonic
  check(&lacking_reference, flat);
}

TEST_CASE("free nodes that fly 1 m away move neither positions, envelope nor coefficients") {
  const Model model = Model::view(eroding_model().span());
  const auto plane = static_cast<std::size_t>(format::padded(model.modes()));
  double largest = 0;
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    if (!has_hole(model.sample(s))) continue;
    const std::uint32_t twin = model.sample_index({model.sample(s).simulation - 1, model.sample(s).time_step});
    for (std::size_t i = 0; i < 3 * std::size_t{model.nodes()}; ++i) {
      const float off = model.node_positions(s)[i] - model.node_positions(twin)[i];
      if (!is_in(patch_nodes(), i / 3)) REQUIRE(off == 0);
      CHECK(std::abs(off) < 1);  // measured 0.1: the bent plate is nearly harmonic there
    }
    // The projection is orthogonal in the inner product of M. The nearest node that is left is at most two edges of
    // 10 mm away from the nine vertices, each of which has the mass of an element, 100 mm^2; in the bent plate vertices
    // correspond to other nodes than their own, up to all of them.
    const auto of = [&](std::uint32_t sample) {
      return model.view().references[0].coefficients.subspan(3 * plane * sample, 3 * plane);
    };
    double squares = 0;
    for (std::size_t i = 0; i < 3 * plane; ++i) squares += std::pow(double{of(s)[i]} - double{of(twin)[i]}, 2);
    largest = std::max(largest, std::sqrt(squares));
  }
  CHECK(largest > 0);
  CHECK(largest <= 20 * std::sqrt(2 * 9 * 100.0));
  const auto& envelope = model.view().envelope;
  CHECK(static_cast<double>(envelope.corner[2] + envelope.cell * static_cast<float>(envelope.cells[2])) < 200);
}
