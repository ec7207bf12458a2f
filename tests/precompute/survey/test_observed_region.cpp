#include "precompute/survey/reference.hpp"

#include "tests/support/synthetic_simulation.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

struct Plate {
  SimulationMesh simulation = plate_mesh({6, 4, 50, 30});  // 24 nodes 10 apart, 15 elements
  CommonMesh mesh = CommonMeshBuilder(simulation, "a").finish();

  ObservedRegion region(const RegionCriteria& criteria) const {
    return observed_region(mesh, simulation.positions, criteria, simulation.node_ids);
  }
};

// The definition, applied element by element.
void check_definition(const Plate& plate, const RegionCriteria& criteria, const ObservedRegion& region) {
  std::vector<std::array<std::uint32_t, 4>> expected;
  for (std::size_t e = 0; e < plate.mesh.elements.size(); ++e) {
    bool in = criteria.parts.empty() || std::ranges::count(criteria.parts, plate.mesh.element_parts[e]) > 0;
    for (const std::uint32_t node : plate.mesh.elements[e]) {
      in = in && (criteria.node_ids.empty() || std::ranges::count(criteria.node_ids, plate.mesh.node_ids[node]) > 0);
      in = in && (criteria.visible.empty() || criteria.visible[node] != 0);
      for (std::size_t axis = 0; criteria.box && axis < 3; ++axis) {
        const double x = static_cast<double>(plate.simulation.positions[3 * node + axis]);
        in = in && x >= criteria.box->min[axis] && x <= criteria.box->max[axis];
      }
    }
    if (in) expected.push_back(plate.mesh.elements[e]);
  }
  std::vector<std::array<std::uint32_t, 4>> found;
  for (const Quad& q : region.elements)
    found.push_back({region.nodes[q[0]], region.nodes[q[1]], region.nodes[q[2]], region.nodes[q[3]]});
  CHECK(found == expected);
  CHECK(std::ranges::is_sorted(region.nodes));
  for (std::uint32_t v = 0; v < region.nodes.size(); ++v)
    CHECK(std::ranges::any_of(region.elements, [&](const Quad& q) { return std::ranges::count(q, v) > 0; }));
}

}  // namespace

TEST_CASE("no criterion: the whole mesh") {
  const Plate plate;
  const ObservedRegion region = plate.region({});
  CHECK(region.elements == plate.mesh.elements);
  CHECK(region.nodes.size() == 24);
}

TEST_CASE("each criterion alone and all together select by their definition") {
  const Plate plate;
  RegionCriteria all;
  all.parts = {1};
  all.box = Box{{0, 0, -1}, {30, 20, 1}};
  for (std::uint32_t id = 1001; id <= 1016; ++id) all.node_ids.push_back(id);
  all.visible.assign(24, 1);
  all.visible[0] = 0;
  RegionCriteria parts, box, ids, visible;
  parts.parts = all.parts;
  box.box = all.box;
  ids.node_ids = all.node_ids;
  visible.visible = all.visible;
  for (const RegionCriteria& criteria : {parts, box, ids, visible, all}) {
    const ObservedRegion region = plate.region(criteria);
    check_definition(plate, criteria, region);
    CHECK(region.elements.size() < plate.mesh.elements.size());
  }
}

TEST_CASE("the box includes its borders") {
  const Plate plate;
  RegionCriteria criteria;
  criteria.box = Box{{10, 10, 0}, {20, 20, 0}};
  CHECK(plate.region(criteria).elements.size() == 1);
}

TEST_CASE("listed nodes without a whole element are dropped") {
  const Plate plate;
  RegionCriteria criteria;
  criteria.node_ids = {1001, 1002, 1007, 1008, 1024};  // one element and a far corner
  const ObservedRegion region = plate.region(criteria);
  CHECK(region.nodes == std::vector<std::uint32_t>{0, 1, 6, 7});
  CHECK(region.elements == std::vector<Quad>{{0, 1, 3, 2}});
}

TEST_CASE("errors name parts and nodes that do not exist") {
  const Plate plate;
  RegionCriteria criteria;
  criteria.node_ids = {1001, 4711};
  CHECK_THROWS_WITH_AS((void)plate.region(criteria), doctest::Contains("names node 4711"), Error);
  criteria = {};
  criteria.parts = {3};
  CHECK_THROWS_WITH_AS((void)plate.region(criteria), doctest::Contains("names part 3"), Error);
  criteria = {};
  criteria.visible = {1, 1};
  CHECK_THROWS_WITH_AS((void)plate.region(criteria), doctest::Contains("2 entries for 24 nodes"), Error);
  criteria = {};
  criteria.box = Box{{100, 0, 0}, {200, 1, 1}};
  CHECK_THROWS_WITH_AS((void)plate.region(criteria), doctest::Contains("widen the region"), Error);
}

TEST_CASE("elements that a reference mesh lacks are not observed") {
  const Plate plate;
  RegionCriteria criteria;
  criteria.present.assign(15, 1);
  criteria.present[0] = 0;
  CHECK(plate.region(criteria).elements.size() == 14);
  CHECK(plate.region(criteria).nodes.size() == 23);  // without the corner
}

TEST_CASE("a listed node that is eroded in all states is accepted") {
  const Plate plate;
  CommonMeshBuilder builder(plate.simulation, "a");
  std::vector<Presence> present(15, Presence::always);
  present[0] = Presence::never;
  builder.keep(common_elements(builder.reference(), plate.simulation, present, "b"), "b");
  const CommonMesh eroded = builder.finish();
  std::vector<float> positions;
  for (const std::uint32_t id : eroded.node_ids)
    for (std::size_t axis = 0; axis < 3; ++axis)
      positions.push_back(plate.simulation.positions[3 * (id - 1001) + axis]);
  const RegionCriteria criteria{{}, {}, plate.simulation.node_ids, {}};
  CHECK(observed_region(eroded, positions, criteria, plate.simulation.node_ids).elements.size() == 14);
}

TEST_CASE("an element without area in the region ended the bake; it is skipped and counted") {
  Plate plate;
  for (const std::size_t node : {0u, 6u})  // of the first element, moved onto its other two
    plate.simulation.positions[3 * node] = plate.simulation.positions[3 * (node + 1)];
  const ObservedRegion region = plate.region({});
  CHECK(region.without_area == 1);
  CHECK(region.elements.size() == 14);
  CHECK(region.nodes.size() == 23);
}
