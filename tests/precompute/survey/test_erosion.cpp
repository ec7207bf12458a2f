// A patch that erodes late in some runs: the model keeps it, and each sample has it or not.
#include "precompute/jobs/jobs.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "tests/precompute/survey/eroding_model.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("a run that never has the patch is baked as if its files had the undeformed mesh") {
  const auto baked = [](bool lacks_places) {
    Ensemble ensemble = eroding_plates(1, steps, 0);
    ensemble.runs[1].open = [=] {
      SyntheticSimulation plate = eroding_plate(0.5, steps, 0);
      SimulationMesh mesh = plate.mesh();
      std::vector<SimulationState> states(steps);
      for (std::uint32_t step = 0; step < steps; ++step) plate.read(step, states[step]);
      if (lacks_places) mesh.guessed.assign(mesh.nodes(), 0);
      for (const std::size_t node : patch_nodes())
        if (lacks_places) mesh.guessed[node] = 1, std::fill_n(&mesh.positions[3 * node], 3, -40.0f);
      return std::make_unique<SyntheticSimulation>(mesh, states, plate.fields());
    };
    const TemporaryFolder folder;
    bake_model(ensemble, bent_plates_description(), folder / "m.lbea");
    return AlignedBytes(folder / "m.lbea");
  };
  const AlignedBytes expected_bytes = baked(false), bytes = baked(true);
  const Model expected = Model::view(expected_bytes.span()), model = Model::view(bytes.span());
  REQUIRE(model.nodes() == 200);
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t i = 0; i < model.node_positions(s).size(); ++i)  // rounded twice more by 190 * 2^-24
      REQUIRE(model.node_positions(s)[i] == doctest::Approx(expected.node_positions(s)[i]).scale(1).epsilon(1e-4));
}

TEST_CASE("a patch that some runs lose stays in the model; samples without it say so") {
  const Model model = Model::view(eroding_model().span());
  CHECK(model.elements() == 171);
  CHECK(model.vertices() == 200);
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const std::vector<std::uint8_t> present = present_elements(model, s);
    REQUIRE(present.size() == model.elements());
    for (std::size_t e = 0; e < model.elements(); ++e) {
      const bool is_eroded = has_hole(model.sample(s)) && is_in(patch_elements(), e);
      REQUIRE((present[e] == 0) == is_eroded);
      REQUIRE(std::isnan(model.field_values(0, s)[e]) == is_eroded);
    }
  }
}

TEST_CASE("elements that all of some samples have are those that none of them lacks") {
  const Model model = Model::view(eroding_model().span());
  const std::uint32_t whole = model.sample_index({0, steps - 1}), eroding = model.sample_index({1, steps - 1});
  for (const std::vector<std::uint32_t>& samples :
       std::vector<std::vector<std::uint32_t>>{{whole}, {whole, eroding}, {eroding, whole}, {}}) {
    const std::vector<std::uint8_t> present = present_in_all(model, samples);
    const bool has_eroding = std::ranges::find(samples, eroding) != samples.end();
    REQUIRE(present.size() == model.elements());
    for (std::size_t e = 0; e < model.elements(); ++e)
      REQUIRE((present[e] == 0) == (has_eroding && is_in(patch_elements(), e)));
  }
}

TEST_CASE("the region has the elements of all reference meshes; the component keeps the others") {
  Ensemble ensemble = eroding_plates(1, steps, from);
  ensemble.reference_run = 1;
  const TemporaryFolder folder;
  bake_model(ensemble, bent_plates_description(ReferenceMode::over_time), folder / "m.lbea");
  const Model over_time = Model::open(folder / "m.lbea");
  CHECK(over_time.elements() == 171);
  CHECK(over_time.vertices() == 200 - 9);
  bake_model(ensemble, bent_plates_description(), folder / "m.lbea");
  CHECK(Model::open(folder / "m.lbea").vertices() == 200);
}

TEST_CASE("a model of runs without erosion has no section for it; other sections of runs that do not erode are equal") {
  const auto bytes_of = [](std::uint32_t eroded_from) {
    const TemporaryFolder folder;
    bake_model(eroding_plates(2, steps, eroded_from), bent_plates_description(), folder / "m.lbea");
    return AlignedBytes(folder / "m.lbea");
  };
  const AlignedBytes whole_bytes = bytes_of(steps), eroding_bytes = bytes_of(from);
  const Model whole = Model::view(whole_bytes.span()), eroding = Model::view(eroding_bytes.span());
  CHECK(whole.view().eroded.empty());
  CHECK(present_elements(whole, 0).empty());
  CHECK_FALSE(eroding.view().eroded.empty());
  CHECK(std::ranges::equal(whole.view().references[0].projection, eroding.view().references[0].projection));
  for (std::uint32_t s = 0; s < whole.samples(); ++s)
    if (!has_hole(whole.sample(s))) CHECK(std::ranges::equal(whole.node_positions(s), eroding.node_positions(s)));
}

TEST_CASE("a damaged section of eroded elements is refused") {
  const auto refused_after = [](const auto& change) {
    AlignedBytes bytes = eroding_model();
    forge(bytes.span(), format::SectionId::eroded_elements, change);
    return status_of(bytes.span()) == Status::corrupt_model;
  };
  using format::SectionEntry;
  CHECK_FALSE(refused_after([](SectionEntry&, std::span<std::byte> section) { set<std::uint32_t>(section, 0, 7); }));
  CHECK(refused_after(
      [](SectionEntry&, std::span<std::byte> section) { set<std::uint32_t>(section, 5, 1u << 171 % 32); }));
  CHECK(refused_after([](SectionEntry& entry, std::span<std::byte>) { entry.shape = {entry.shape[0] * 6, 1, 1}; }));
  CHECK(refused_after([](SectionEntry& entry, std::span<std::byte>) { entry.element_type = 4; }));
}

TEST_CASE("states without any element, and runs that lose more than half of them, are named") {
  const auto with_last = [](std::size_t eroded) {
    Ensemble ensemble = eroding_plates(1, steps, steps);
    ensemble.runs[1].open = [eroded] {
      SyntheticSimulation plate = bending_plate(0.5, steps);
      std::vector<SimulationState> states(steps);
      for (std::uint32_t step = 0; step < steps; ++step) plate.read(step, states[step]);
      std::fill_n(states.back().alive.begin(), eroded, std::uint8_t{0});
      return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields());
    };
    return ensemble;
  };
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  check_error(error_of([&] { (void)plan_bake(work, with_last(171), bent_plates_description(), {}); }),
              Status::bad_input, {"run eroding_0, state 5: all elements are eroded"});
  BakeOptions leaving_out;
  leaving_out.leaves_out_broken = true;
  const BakeSummary without = bake_model(with_last(171), bent_plates_description(), folder / "m.lbea", leaving_out);
  CHECK(without.losses.eroding == 0);
  CHECK(without.losses.runs.empty());
  const auto warned = [](const BakeSummary& summary) {
    return std::ranges::any_of(summary.warnings, [](const std::string& warning) {
      return contains(warning, "run eroding_0: 100 of its 171 elements are eroded in state 5");
    });
  };
  CHECK(warned(bake_model(with_last(100), bent_plates_description(), folder / "m.lbea")));
  CHECK_FALSE(warned(bake_model(with_last(80), bent_plates_description(), folder / "m.lbea")));
}

TEST_CASE("a run that fails after the plan does not count as eroding") {
  Ensemble ensemble = eroding_plates(1, steps, from);
  const auto fails = std::make_shared<bool>(false);
  ensemble.runs[1].open = [=, open = ensemble.runs[1].open] {
    if (*fails) throw Error(Status::bad_input, "the run is gone");
    return open();
  };
  BakeOptions options;
  options.leaves_out_broken = true;
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work", false);
  const BakePlan plan = plan_bake(work, ensemble, bent_plates_description(), options);
  CHECK(plan.survey.losses.runs == std::vector<std::string>{"eroding_0"});
  CHECK(plan.survey.losses.eroding == 16);
  *fails = true;
  bake_shard(work, plan, {0, 1}, options);
  const BakeSummary summary = merge_shards(work, plan, folder / "m.lbea", options);
  REQUIRE(summary.left_out.size() == 1);
  CHECK(summary.losses.runs.empty());
  CHECK(summary.losses.eroding == 0);
}
