// Ensembles whose runs differ: eroded elements, other meshes, other fields, other steps.
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr PlateShape shape{8, 5, 70, 40};  // 40 nodes, 28 elements

SyntheticSimulation simple(const SimulationMesh& mesh, double angle, std::uint32_t eroded_element,
                           std::uint32_t eroded_from) {
  std::vector<SimulationState> states;
  for (std::uint32_t step = 0; step < 4; ++step) {
    SimulationState state = bent_state(mesh, 0.0005 * step, angle * step / 3, 70);
    for (std::size_t e = 0; e < mesh.elements.size(); ++e) state.fields[0][e] = static_cast<float>(mesh.element_ids[e]);
    if (step >= eroded_from && eroded_element < mesh.elements.size()) state.alive[eroded_element] = 0;
    states.push_back(std::move(state));
  }
  return {mesh, std::move(states), {{"plastic_strain", "1"}}};
}

Ensemble two_runs(const SyntheticSimulation& a, const SyntheticSimulation& b) {
  Ensemble ensemble;
  ensemble.runs.push_back({"a", {}, [a] { return std::make_unique<SyntheticSimulation>(a); }});
  ensemble.runs.push_back({"b", {}, [b] { return std::make_unique<SyntheticSimulation>(b); }});
  return ensemble;
}

EnsembleDescription ten_modes() {
  EnsembleDescription description;
  description.modes = 10;
  return description;
}

constexpr std::uint32_t none = 0xffffffff;

Model baked(const TemporaryFolder& folder, const Ensemble& ensemble, const EnsembleDescription& description) {
  bake_model(ensemble, description, folder / "m.lbea");
  return Model::open(folder / "m.lbea");
}

void check_fields_follow_ids(const Model& model) {
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t e = 0; e < model.elements(); ++e)
      REQUIRE(model.field_values(0, s)[e] == static_cast<float>(model.element_ids()[e]));
}

}  // namespace

TEST_CASE("an element eroded in all samples is removed from the surface") {
  const SimulationMesh mesh = plate_mesh(shape);
  const Ensemble ensemble = two_runs(simple(mesh, 0.5, 10, 0), simple(mesh, 1, 10, 0));
  const TemporaryFolder folder;
  const Model model = baked(folder, ensemble, ten_modes());
  CHECK(model.elements() == 27);
  CHECK(std::ranges::find(model.element_ids(), mesh.element_ids[10]) == model.element_ids().end());
  CHECK(model.nodes() == 40);
  check_fields_follow_ids(model);
  CHECK(model.view().eroded.empty());  // nothing is lacked that the model has
}

TEST_CASE("runs with other numbering orders and other elements share what is common") {
  const SimulationMesh mesh = plate_mesh(shape);
  SimulationMesh other = mesh;  // nodes reversed, the last element missing, a node more
  std::ranges::reverse(other.node_ids);
  for (std::size_t i = 0; i < 40; ++i) std::copy_n(&mesh.positions[3 * (39 - i)], 3, &other.positions[3 * i]);
  for (Quad& q : other.elements)
    for (std::uint32_t& node : q) node = 39 - node;
  other.elements.pop_back();
  other.element_ids.pop_back();
  other.element_parts.pop_back();
  other.node_ids.push_back(5);
  other.positions.insert(other.positions.end(), {-500, -500, -500});  // far away and used by nothing
  const TemporaryFolder folder;
  const Model model = baked(folder, two_runs(simple(mesh, 0.5, none, 0), simple(other, 0.5, none, 0)), ten_modes());
  CHECK(model.elements() == 27);
  CHECK(model.nodes() == 39);  // the missing element was the corner's only one
  check_fields_follow_ids(model);
  for (std::uint32_t step = 0; step < 4; ++step)  // the same bending, whatever the order of its nodes
    CHECK(std::ranges::equal(model.node_positions(step), model.node_positions(4 + step)));
}

TEST_CASE("reference run and impact step follow the description") {
  const SimulationMesh mesh = plate_mesh(shape);
  Ensemble ensemble = two_runs(simple(mesh, 0.5, none, 0), simple(mesh, 1, none, 0));
  ensemble.reference_run = 1;
  EnsembleDescription description = ten_modes();
  description.impact_step = 1;
  description.steps.first = 1;
  description.time_factor = 2;
  for (const ReferenceMode mode : {ReferenceMode::impact, ReferenceMode::over_time}) {
    description.mode = mode;
    const TemporaryFolder folder;
    const Model model = baked(folder, ensemble, description);
    CHECK(model.samples() == 6);
    CHECK(model.sample_time_s(0) == 2 * 0.0005);
    CHECK(model.references() == (mode == ReferenceMode::impact ? 1u : 3u));
    for (std::uint32_t r = 0; r < model.references(); ++r) {
      CHECK(model.reference_time_s(r) == doctest::Approx(2 * 0.0005 * r));  // since impact
      const auto own = model.node_positions(3 + r);                         // run b, state 1 + r
      for (std::size_t v = 0; v < model.vertices(); ++v) {
        const std::size_t node = model.vertex_nodes(r)[v];
        CHECK(std::ranges::equal(model.vertex_positions(r).subspan(3 * v, 3), own.subspan(3 * node, 3)));
      }
    }
  }
}

TEST_CASE("the region bounds the vertices, the component stays whole") {
  const SimulationMesh mesh = plate_mesh(shape);
  const Ensemble ensemble = two_runs(simple(mesh, 0.5, none, 0), simple(mesh, 1, none, 0));
  EnsembleDescription description = ten_modes();
  description.region.parts = {2};
  const TemporaryFolder folder;
  const Model model = baked(folder, ensemble, description);
  CHECK(model.nodes() == 40);
  CHECK(model.vertices() == 20);  // columns 4 to 7
  for (const std::uint32_t node : model.vertex_nodes(0)) CHECK(node % 8 >= 4);

  BakeOptions options;
  options.visible_nodes = [](const CommonMesh& common, std::span<const float> positions) {
    std::vector<std::uint8_t> visible(common.node_ids.size());
    for (std::size_t i = 0; i < visible.size(); ++i) visible[i] = positions[3 * i + 1] < 21;
    return visible;
  };
  const BakeSummary summary = bake_model(ensemble, description, folder / "m.lbea", options);
  CHECK(summary.vertices == 12);  // and rows 0 to 2
}

TEST_CASE("fields: all, none or some, in any order of the runs' fields") {
  const SimulationMesh mesh = plate_mesh(shape);
  const auto with_fields = [&](std::vector<SimulationField> fields) {
    SimulationState state = bent_state(mesh, 0, 0, 70);
    state.fields.clear();
    for (const SimulationField& field : fields) state.fields.emplace_back(28, field.name == "stress" ? 7.f : 3.f);
    return SyntheticSimulation(mesh, {state}, fields);
  };
  const Ensemble ensemble =
      two_runs(with_fields({{"strain", "1"}, {"stress", "MPa"}}), with_fields({{"stress", "MPa"}, {"strain", "1"}}));
  const std::vector<std::pair<std::vector<std::string>, std::uint32_t>> choices{{{"all"}, 2}, {{}, 0}, {{"stress"}, 1}};
  for (const auto& [fields, count] : choices) {
    EnsembleDescription description = ten_modes();
    description.fields = fields;
    const TemporaryFolder folder;
    const Model model = baked(folder, ensemble, description);
    REQUIRE(model.fields() == count);
    for (std::uint32_t f = 0; f < count; ++f)
      for (std::uint32_t s = 0; s < 2; ++s)
        CHECK(model.field_values(f, s)[0] == (model.field(f).name == "stress" ? 7.f : 3.f));
    if (count == 1) CHECK(model.field(0).unit == "MPa");
  }
}
