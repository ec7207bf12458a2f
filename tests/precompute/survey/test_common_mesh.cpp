#include "precompute/survey/common_mesh.hpp"

#include "tests/support/synthetic_simulation.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

std::vector<Presence> always(const SimulationMesh& mesh) {
  return std::vector<Presence>(mesh.elements.size(), Presence::always);
}

SimulationMesh plate() { return plate_mesh({5, 4, 40, 30}); }  // 20 nodes, 12 elements

/// The same mesh, nodes and elements in another order.
SimulationMesh shuffled(const SimulationMesh& mesh, std::uint32_t seed) {
  std::mt19937 random(seed);
  std::vector<std::uint32_t> nodes(mesh.nodes()), elements(mesh.elements.size());
  for (std::uint32_t i = 0; i < nodes.size(); ++i) nodes[i] = i;
  for (std::uint32_t e = 0; e < elements.size(); ++e) elements[e] = e;
  std::shuffle(nodes.begin(), nodes.end(), random);
  std::shuffle(elements.begin(), elements.end(), random);
  std::vector<std::uint32_t> place(nodes.size());
  SimulationMesh other;
  for (std::uint32_t i = 0; i < nodes.size(); ++i) {
    place[nodes[i]] = i;
    other.node_ids.push_back(mesh.node_ids[nodes[i]]);
    other.positions.insert(other.positions.end(), &mesh.positions[3 * nodes[i]], &mesh.positions[3 * nodes[i]] + 3);
  }
  for (const std::uint32_t e : elements) {
    const Quad& q = mesh.elements[e];
    other.elements.push_back({place[q[0]], place[q[1]], place[q[2]], place[q[3]]});
    other.element_ids.push_back(mesh.element_ids[e]);
    other.element_parts.push_back(mesh.element_parts[e]);
  }
  return other;
}

void remove_element(SimulationMesh& mesh, std::size_t element) {
  const auto at = static_cast<std::ptrdiff_t>(element);
  mesh.elements.erase(mesh.elements.begin() + at);
  mesh.element_ids.erase(mesh.element_ids.begin() + at);
  mesh.element_parts.erase(mesh.element_parts.begin() + at);
}

void keep_common(CommonMeshBuilder& builder, const SimulationMesh& mesh, const std::vector<Presence>& present,
                 const std::string& run) {
  builder.keep(common_elements(builder.reference(), mesh, present, run), run);
}

}  // namespace

TEST_CASE("runs with the same mesh keep it") {
  const SimulationMesh mesh = plate();
  CommonMeshBuilder builder(mesh, "a");
  keep_common(builder, mesh, always(mesh), "a");
  const CommonMesh common = builder.finish();
  CHECK(common.node_ids == mesh.node_ids);
  CHECK(common.elements == mesh.elements);
  CHECK(common.element_ids == mesh.element_ids);
  CHECK(common.element_parts == mesh.element_parts);
}

TEST_CASE("an element that erodes in some samples stays") {
  const SimulationMesh mesh = plate();
  for (const Presence presence : {Presence::sometimes, Presence::never}) {
    CommonMeshBuilder builder(mesh, "a");
    auto present = always(mesh);
    present[3] = presence;
    keep_common(builder, mesh, always(mesh), "a");
    keep_common(builder, mesh, present, "b");
    CHECK(builder.finish().element_ids == mesh.element_ids);
    CHECK(builder.losses().eroding == 1);
    CHECK(builder.losses().eroded == 0);
    CHECK(builder.losses().runs == std::vector<std::string>{"b"});
    CHECK(builder.lack_elements() == std::vector<std::uint8_t>{0, 1});
  }
}

TEST_CASE("faces between two solids are kept where erosion exposes them in some sample") {
  SimulationMesh mesh = plate();
  mesh.touching = 4;  // the last four elements as two pairs of faces
  const auto usual = [&] {
    auto present = always(mesh);
    std::fill(present.end() - 4, present.end(), Presence::never);
    return present;
  };
  CommonMeshBuilder builder(mesh, "a");
  keep_common(builder, mesh, usual(), "a");
  CHECK(builder.finish().elements.size() == 8);
  CHECK(builder.lack_elements() == std::vector<std::uint8_t>{0});
  auto exposing = usual();
  exposing[9] = Presence::sometimes;
  keep_common(builder, mesh, exposing, "b");
  exposing[9] = Presence::always;
  keep_common(builder, mesh, exposing, "c");
  CHECK(builder.finish().elements.size() == 9);
  CHECK(builder.losses().exposed == 1);
  CHECK(builder.losses().runs.empty());  // no outer element erodes
  CHECK(builder.lack_elements() == std::vector<std::uint8_t>{1, 1, 0});
}

TEST_CASE("a face that some run does not have does not make up for one that another run exposes") {
  SimulationMesh mesh = plate();
  mesh.touching = 4;
  auto usual = always(mesh);
  std::fill(usual.end() - 4, usual.end(), Presence::never);
  const auto with = [&](std::size_t element, Presence presence) {
    auto present = usual;
    present[element] = presence;
    return present;
  };
  CommonMeshBuilder builder(mesh, "a");
  builder.keep(with(8, Presence::always), "a");  // which b lacks
  builder.keep(with(8, Presence::missing), "b");
  builder.keep(with(9, Presence::always), "c");
  CHECK(builder.finish().elements.size() == 9);
  CHECK(builder.lack_elements() == std::vector<std::uint8_t>{1, 1, 0});
}

TEST_CASE("an element eroded in all samples is dropped, with the nodes that only it uses") {
  const SimulationMesh mesh = plate();
  CommonMeshBuilder builder(mesh, "a");
  auto present = always(mesh);
  present[0] = Presence::never;  // the corner at the origin: its node 0 belongs to nothing else
  keep_common(builder, mesh, present, "b");
  CHECK(builder.lack_elements() == std::vector<std::uint8_t>{0});  // what is left out is not lacked
  const CommonMesh common = builder.finish();
  CHECK(common.elements.size() == 11);
  CHECK(std::ranges::find(common.element_ids, 501u) == common.element_ids.end());
  CHECK(common.node_ids.size() == 19);
  CHECK(std::ranges::find(common.node_ids, 1001u) == common.node_ids.end());
  const auto used = [&](std::uint32_t node) {
    return std::ranges::any_of(common.elements, [&](const Quad& q) { return std::ranges::find(q, node) != q.end(); });
  };
  for (std::uint32_t node = 0; node < common.node_ids.size(); ++node) CHECK(used(node));
}

TEST_CASE("meshes with another order of nodes and elements are matched by ids") {
  const SimulationMesh mesh = plate();
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const SimulationMesh other = shuffled(mesh, seed);
    CommonMeshBuilder builder(mesh, "a");
    keep_common(builder, other, always(other), "b");
    const CommonMesh common = builder.finish();
    CHECK(common.node_ids == mesh.node_ids);
    CHECK(common.elements == mesh.elements);
    const MeshMapping mapping = map_common(common, other, "b");
    for (std::size_t i = 0; i < mapping.nodes.size(); ++i)
      CHECK(other.node_ids[mapping.nodes[i]] == common.node_ids[i]);
    for (std::size_t e = 0; e < mapping.elements.size(); ++e)
      CHECK(other.element_ids[mapping.elements[e]] == common.element_ids[e]);
  }
}

TEST_CASE("an element eroded in a run of another order is found by its id") {
  const SimulationMesh mesh = plate(), other = shuffled(mesh, 3);
  CommonMeshBuilder builder(mesh, "a");
  auto present = always(other);
  present[4] = Presence::never;
  keep_common(builder, other, present, "b");
  const CommonMesh common = builder.finish();
  CHECK(common.elements.size() == 11);
  CHECK(std::ranges::find(common.element_ids, other.element_ids[4]) == common.element_ids.end());
}

TEST_CASE("elements that a run lacks or connects differently are not common; the order of runs does not matter") {
  const SimulationMesh mesh = plate();
  SimulationMesh lacking = mesh, rewired = shuffled(mesh, 7);
  remove_element(lacking, 11);
  rewired.elements[0][0] = rewired.elements[1][0];  // same id, other nodes
  const std::uint32_t rewired_id = rewired.element_ids[0];
  CommonMeshBuilder forward(mesh, "a"), backward(mesh, "a");
  keep_common(forward, lacking, always(lacking), "b");
  keep_common(forward, rewired, always(rewired), "c");
  keep_common(backward, rewired, always(rewired), "c");
  keep_common(backward, lacking, always(lacking), "b");
  const CommonMesh common = forward.finish();
  CHECK(common.element_ids == backward.finish().element_ids);
  CHECK(common.elements.size() == (rewired_id == mesh.element_ids[11] ? 11 : 10));
  CHECK(std::ranges::find(common.element_ids, rewired_id) == common.element_ids.end());
  CHECK(std::ranges::find(common.element_ids, mesh.element_ids[11]) == common.element_ids.end());
}

TEST_CASE("the faces of one solid share an id and stay separate elements") {
  SimulationMesh mesh = plate();
  for (auto& id : mesh.element_ids) id = 7;
  SimulationMesh other = mesh;
  remove_element(other, 3);
  CommonMeshBuilder builder(mesh, "a");
  keep_common(builder, other, always(other), "b");
  const CommonMesh common = builder.finish();
  CHECK(common.elements.size() == 11);
  const MeshMapping mapping = map_common(common, mesh, "a");
  CHECK(mapping.elements == std::vector<std::uint32_t>{0, 1, 2, 4, 5, 6, 7, 8, 9, 10, 11});
}

TEST_CASE("errors name the run and the id") {
  SimulationMesh twice = plate();
  twice.node_ids[3] = twice.node_ids[2];
  CHECK_THROWS_WITH_AS(CommonMeshBuilder(twice, "x"), doctest::Contains("run x: node id 1003 is given twice"), Error);
  SimulationMesh beyond = plate();
  beyond.elements[0][1] = 20;
  CHECK_THROWS_WITH_AS(CommonMeshBuilder(beyond, "x"), doctest::Contains("names node index 20"), Error);
  const SimulationMesh mesh = plate();
  CommonMeshBuilder builder(mesh, "a");
  CHECK_THROWS_WITH_AS(keep_common(builder, mesh, {}, "b"), doctest::Contains("deletion flags for 0 elements"), Error);
  keep_common(builder, mesh, std::vector<Presence>(12, Presence::never), "b");
  CHECK_THROWS_WITH_AS((void)builder.finish(), doctest::Contains("no element is common"), Error);
}

TEST_CASE("mapping a mesh that lacks something is refused") {
  const SimulationMesh mesh = plate();
  const CommonMesh common = CommonMeshBuilder(mesh, "a").finish();
  SimulationMesh other = mesh;
  other.node_ids[4] = 77;
  CHECK_THROWS_WITH_AS((void)map_common(common, other, "b"), doctest::Contains("run b: node 1005 is missing"), Error);
  other = mesh;
  remove_element(other, 2);
  CHECK_THROWS_WITH_AS((void)map_common(common, other, "b"), doctest::Contains("run b: element 503 is missing"), Error);
}
