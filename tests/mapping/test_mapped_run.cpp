// Bakes whose runs have several meshes.
#include "precompute/mapping/mapped_run.hpp"
#include "tests/mapping/meshes.hpp"
#include "tests/precompute/jobs/shard_plates.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/resampled_run.hpp"

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr PlateShape fine{34, 17, 190, 90};

SyntheticSimulation bending(const SimulationMesh& mesh, double angle, std::uint32_t steps = 4) {
  std::vector<SimulationState> states;
  for (std::uint32_t step = 0; step < steps; ++step)
    states.push_back(bent_state(mesh, 0.0005 * step, angle * step / (steps - 1), 190));
  return {mesh, std::move(states), {{"plastic_strain", "1"}}};
}

EnsembleRun run_of(const std::string& name, const SyntheticSimulation& run) {
  return {name, {}, [run] { return std::make_unique<SyntheticSimulation>(run); }, name};
}

EnsembleRun resampled_run_of(const std::string& name, const SyntheticSimulation& run) {
  return {name, {}, [run] { return std::make_unique<ResampledRun>(std::make_unique<SyntheticSimulation>(run)); }, name};
}

EnsembleDescription ten_modes() {
  EnsembleDescription description;
  description.modes = 10;
  return description;
}

/// The reference run, the same run on a finer mesh, on another triangulation, and renumbered.
Ensemble four_meshes() {
  const SimulationMesh mesh = plate_mesh(coarse);
  return {{run_of("own", bending(mesh, 1)), run_of("fine", bending(plate_mesh(fine), 1)),
           resampled_run_of("resampled", bending(mesh, 1)), run_of("renumbered", bending(renumbered(mesh), 1))},
          {},
          0};
}

}  // namespace

TEST_CASE("runs with other meshes become samples on the reference mesh") {
  const TemporaryFolder folder;
  const BakeSummary summary = bake_model(four_meshes(), ten_modes(), folder / "m.lbea");
  const Model model = Model::open(folder / "m.lbea");
  REQUIRE(summary.mapped.size() == 3);
  CHECK(summary.mapped[0].name == "fine");
  CHECK(summary.mapped[0].mapping.run_elements == 33 * 16);
  CHECK(summary.mapped[0].mapping.mapped_elements == 171);
  CHECK(summary.losses.missing == 0);
  REQUIRE(model.elements() == 171);
  const auto positions = [&](std::uint32_t run, std::uint32_t step) {
    const auto of_sample = model.node_positions(4 * run + step);
    return std::vector<float>(of_sample.begin(), of_sample.end());
  };
  for (std::uint32_t step = 0; step < 4; ++step) {
    CHECK(positions(3, step) == positions(0, step));  // renumbered: bit by bit
    // Chords of elements of 10 mm, of the own mesh or cut off by the other triangulation, at the step's radius.
    const double sagitta = 10.0 * 10 / 8 * (step / 3.0) / 190;
    CHECK(largest_difference(positions(1, step), positions(0, step)) <= sagitta + 1e-4);
    CHECK(largest_difference(positions(2, step), positions(0, step)) <= sagitta + 1e-4);
    // The field is the bending angle at the first node of an element: within an element of the own.
    for (std::size_t e = 0; e < model.elements(); ++e)
      for (const std::uint32_t run : {1u, 2u, 3u}) {
        const double off = double{model.field_values(0, 4 * run + step)[e]} - double{model.field_values(0, step)[e]};
        CHECK(std::abs(off) <= (run == 3 ? 0 : 10.0 / 190 + 1e-6));
      }
  }
}

TEST_CASE("runs with the reference run's numbers go the old way: the model does not change") {
  const SimulationMesh mesh = plate_mesh(coarse);
  SimulationMesh smaller = mesh, shifted = mesh;
  smaller.elements.pop_back();
  smaller.element_ids.pop_back();
  smaller.element_parts.pop_back();
  for (float& value : shifted.positions) value += 2;  // where the numbers are equal, places do not count
  Ensemble ensemble{
      {run_of("a", bending(mesh, 1)), run_of("b", bending(smaller, 0.5)), run_of("c", bending(shifted, 2))}, {}, 0};
  EnsembleDescription by_numbers = ten_modes();
  by_numbers.mapping.enabled = false;
  const TemporaryFolder folder;
  const BakeSummary summary = bake_model(ensemble, ten_modes(), folder / "a.lbea");
  bake_model(ensemble, by_numbers, folder / "b.lbea");
  CHECK(summary.mapped.empty());
  CHECK(summary.elements == 170);
  CHECK(text_of(folder / "a.lbea") == text_of(folder / "b.lbea"));
}

TEST_CASE("without mapping, runs numbered in another way are refused as before") {
  EnsembleDescription by_numbers = ten_modes();
  by_numbers.mapping.enabled = false;
  const TemporaryFolder folder;
  check_error(error_of([&] { bake_model(four_meshes(), by_numbers, folder / "m.lbea"); }), Status::bad_input,
              {"no element is common"});
}

TEST_CASE("an element erodes with any of those that carry it") {
  Ensemble ensemble = four_meshes();
  ensemble.runs.resize(1);
  const SimulationMesh mesh = plate_mesh(fine);
  std::vector<SimulationState> states{bent_state(mesh, 0, 0, 190), bent_state(mesh, 0.0005, 0.5, 190)};
  states[1].alive[8 * 33 + 16] = 0;  // in the middle of the plate, inside one element of the reference mesh
  ensemble.runs.push_back(run_of("eroding", {mesh, states, {{"plastic_strain", "1"}}}));
  const TemporaryFolder folder;
  const BakeSummary summary = bake_model(ensemble, ten_modes(), folder / "m.lbea");
  CHECK(summary.losses.eroded == 0);
  CHECK(summary.losses.eroding > 0);
  CHECK(summary.losses.eroding <= 4);
  CHECK(summary.losses.runs == std::vector<std::string>{"eroding"});
}

TEST_CASE("shards with mapped runs give the bytes of a single process") {
  const Ensemble ensemble = four_meshes();
  const EnsembleDescription description = ten_modes();
  const std::string alone = baked_alone(ensemble, description);
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  (void)plan_bake(work, ensemble, description, shard_options());
  const auto open = [&](const std::string& source) {
    return std::ranges::find(ensemble.runs, source, &EnsembleRun::name)->open();
  };
  for (const std::uint32_t shard : {1u, 0u}) bake_shard(work, read_plan(work, open), {shard, 2}, shard_options());
  CHECK(merged(work, read_plan(work, open)) == alone);
}

TEST_CASE("a mapped run names all files that it is read from") {
  class OfFiles : public SyntheticSimulation {
   public:
    using SyntheticSimulation::SyntheticSimulation;
    std::vector<std::filesystem::path> files() const override { return {"run.pvtu"}; }
    std::vector<std::filesystem::path> named_files() const override { return {"piece.vtu"}; }
  };
  const SyntheticSimulation reference = bending(plate_mesh(coarse), 1), other = bending(plate_mesh(fine), 1);
  RunMapper mapper([&] { return std::make_unique<SyntheticSimulation>(reference); }, {}, "mm");
  SimulationState state;
  SyntheticSimulation run = other;
  run.read(0, state);
  const auto mapped = mapper.mapped(std::make_unique<OfFiles>(other.mesh(), std::vector{state}, other.fields()), "run");
  REQUIRE(mapped->mapping());
  CHECK(all_files(*mapped) == std::vector<std::filesystem::path>{"run.pvtu", "piece.vtu"});
}

TEST_CASE("other settings of the mapping are another survey; the same are not repeated") {
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  EnsembleDescription description = ten_modes();
  const BakePlan first = plan_bake(work, four_meshes(), description, shard_options());
  const BakePlan again = plan_bake(work, four_meshes(), description, shard_options());
  description.mapping.by_part = false;
  const BakePlan other = plan_bake(work, four_meshes(), description, shard_options());
  CHECK(again.runs[1].survey == first.runs[1].survey);
  CHECK(again.runs[1].record == first.runs[1].record);
  CHECK(other.runs[1].survey != first.runs[1].survey);
}

TEST_CASE("damaged runs with other meshes are refused by their own nodes and states") {
  Ensemble ensemble = four_meshes();
  ensemble.runs.resize(1);
  const SimulationMesh mesh = plate_mesh(fine);
  const auto refusal = [&](const SyntheticSimulation& run) {
    Ensemble with = ensemble;
    with.runs.push_back(run_of("broken", run));
    const TemporaryFolder folder;
    return error_of([&] { bake_model(with, ten_modes(), folder / "m.lbea"); });
  };
  SyntheticSimulation good = bending(mesh, 1, 2);
  SimulationState first, second;
  good.read(0, first);
  good.read(1, second);
  SimulationState not_finite = second, cut = second;
  not_finite.positions[30] = std::numeric_limits<float>::quiet_NaN();
  cut.positions.resize(30);
  check_error(refusal({mesh, {first, not_finite}, good.fields()}), Status::bad_input,
              {"run broken, state 1", "node 1011 is not finite"});
  check_error(refusal({mesh, {first, cut}, good.fields()}), Status::bad_input, {"run broken, state 1", "does not fit"});
  SimulationMesh wrong = mesh;
  wrong.elements[5][2] = 100'000;
  check_error(refusal({wrong, {first, second}, good.fields()}), Status::bad_input, {"run broken", "node index 100000"});
  SimulationMesh incomplete = mesh;
  incomplete.positions.resize(12);
  check_error(refusal({incomplete, {first, second}, good.fields()}), Status::bad_input, {"run broken", "not complete"});
  SimulationMesh far = mesh;
  for (float& value : far.positions) value += 500;
  check_error(refusal({far, {first, second}, good.fields()}), Status::bad_input, {"run broken", "mean", "mapping"});
}
