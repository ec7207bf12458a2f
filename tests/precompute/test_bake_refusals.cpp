// What a bake refuses, with which sentence, and that no file is left behind.
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <map>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

void check_refused(const Ensemble& ensemble, const EnsembleDescription& description, Status status, const char* words) {
  const TemporaryFolder folder;
  check_error(error_of([&] { bake_model(ensemble, description, folder / "m.lbea"); }), status, {words});
  CHECK(std::filesystem::is_empty(folder.path()));
}

void replace_state(EnsembleRun& run, std::uint32_t step, const std::function<void(SimulationState&)>& change) {
  SyntheticSimulation plate = bending_plate(0.8, 6);
  std::vector<SimulationState> states(6);
  for (std::uint32_t i = 0; i < 6; ++i) plate.read(i, states[i]);
  change(states[step]);
  run.open = [plate, states] { return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields()); };
}

}  // namespace

TEST_CASE("invalid ensembles are refused") {
  const EnsembleDescription description = bent_plates_description();
  check_refused({}, description, Status::bad_config, "the ensemble has no runs");
  Ensemble ensemble = bent_plates();
  ensemble.runs[1].name = "plate_0";
  check_refused(ensemble, description, Status::bad_config, "two runs are called 'plate_0'");
  ensemble = bent_plates();
  ensemble.runs[2].parameters.clear();
  check_refused(ensemble, description, Status::bad_config, "run plate_2 has 0 parameters, not 1");
  ensemble = bent_plates();
  ensemble.reference_run = 4;
  check_refused(ensemble, description, Status::bad_config, "reference run");
}

TEST_CASE("descriptions that contradict the ensemble are refused") {
  const Ensemble ensemble = bent_plates();
  EnsembleDescription description = bent_plates_description();
  description.fields = {"stress"};
  check_refused(ensemble, description, Status::bad_config, "has no field 'stress'; it has: plastic_strain");
  description = bent_plates_description();
  description.impact_step = 6;
  check_refused(ensemble, description, Status::bad_config, "the impact is at state 6, but run plate_0 has 6 states");
  description = bent_plates_description();
  description.envelope_margin = 0;
  check_refused(ensemble, description, Status::bad_config, "margin");
  description = bent_plates_description();
  description.time_factor = NAN;
  check_refused(ensemble, description, Status::bad_config, "time factor");
  description = bent_plates_description();
  description.region.node_ids = {4711};
  check_refused(ensemble, description, Status::bad_config, "node 4711");
}

TEST_CASE("errors about damaged states name run, state and node") {
  for (const std::size_t damaged_run : {0u, 3u}) {
    Ensemble ensemble = bent_plates();
    replace_state(ensemble.runs[damaged_run], 4, [](SimulationState& state) { state.positions[3 * 17 + 1] = NAN; });
    const std::string words = "run plate_" + std::to_string(damaged_run) + ", state 4: the position of node 1018";
    check_refused(ensemble, bent_plates_description(), Status::bad_input, words.c_str());
    replace_state(ensemble.runs[damaged_run], 2, [](SimulationState& state) { state.positions.pop_back(); });
    check_refused(ensemble, bent_plates_description(), Status::bad_input, "state 2: the state does not fit the mesh");
    replace_state(ensemble.runs[damaged_run], 2, [](SimulationState& state) { state.fields[0].pop_back(); });
    check_refused(ensemble, bent_plates_description(), Status::bad_input, "state 2: the state does not fit the mesh");
  }
}

TEST_CASE("a node that shoots away is named with its place, also beyond what a model may hold") {
  for (const auto& [x, words] : {std::pair{1e6f, "run plate_1, state 4: node 1018 is at (1e+06, 0, "},
                                 {1e13f, "run plate_1, state 4: the position of node 1018 is not finite or beyond"},
                                 {1e30f, "run plate_1, state 4: the position of node 1018 is not finite or beyond"}}) {
    Ensemble ensemble = bent_plates();
    replace_state(ensemble.runs[1], 4, [x = x](SimulationState& state) {
      state.positions[3 * 17] = x;
      state.positions[3 * 17 + 1] = 0;
    });
    check_refused(ensemble, bent_plates_description(), Status::bad_input, words);
  }
}

TEST_CASE("far nodes of eroded elements do not matter") {
  Ensemble ensemble = bent_plates();
  replace_state(ensemble.runs[1], 4, [](SimulationState& state) {
    state.positions[0] = 1e6f;  // the corner of the plate
    state.alive[0] = 0;
  });
  const TemporaryFolder folder;
  CHECK_NOTHROW(bake_model(ensemble, bent_plates_description(), folder / "m.lbea"));
}

TEST_CASE("a field without any number is reported") {
  Ensemble ensemble = bent_plates();
  ensemble.runs[1].open = [] {
    SyntheticSimulation plate = bending_plate(0.8, 6);
    std::vector<SimulationState> states(6);
    for (std::uint32_t i = 0; i < 6; ++i) {
      plate.read(i, states[i]);
      std::ranges::fill(states[i].fields[0], NAN);
    }
    return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields());
  };
  const TemporaryFolder folder;
  const BakeSummary summary = bake_model(ensemble, bent_plates_description(), folder / "m.lbea");
  REQUIRE(summary.warnings.size() == 1);
  CHECK(contains(summary.warnings[0], "run plate_1: field 'plastic_strain' has no number"));
}

TEST_CASE("the error about a collapsed reference mesh names the node") {
  Ensemble ensemble = bent_plates();
  replace_state(ensemble.runs[0], 5, [](SimulationState& state) { std::ranges::fill(state.positions, 1.0f); });
  EnsembleDescription description = bent_plates_description(ReferenceMode::over_time);
  check_refused(ensemble, description, Status::bad_input, "the elements around node 1001 have no area");
}

TEST_CASE("a run that changes between the two readings is noticed") {
  Ensemble ensemble = bent_plates();
  const auto opened = std::make_shared<std::atomic<int>>(0);
  ensemble.runs[1].open = [opened] {
    const float width = ++*opened == 1 ? 90.f : 180.f;
    return std::make_unique<SyntheticSimulation>(bending_plate(0.5, 6, {20, 10, 190, width}));
  };
  check_refused(ensemble, bent_plates_description(), Status::bad_input, "run plate_1 changed while it was read");
}

TEST_CASE("a bake can be cancelled at every step and leaves nothing") {
  const EnsembleDescription description = bent_plates_description(ReferenceMode::over_time);
  const auto count_questions = [&](int cancel_at) {
    const TemporaryFolder folder;
    int questions = 0;
    BakeOptions options;
    options.threads = 1;
    options.cancelled = [&] { return ++questions == cancel_at; };
    if (cancel_at == 0) {
      bake_model(bent_plates(), description, folder / "m.lbea", options);
      CHECK(std::filesystem::exists(folder / "m.lbea"));
    } else {
      CHECK_THROWS_AS(bake_model(bent_plates(), description, folder / "m.lbea", options), BakeCancelled);
      CHECK(std::filesystem::is_empty(folder.path()));
    }
    return questions;
  };
  const int all = count_questions(0);
  CHECK(all >= 24 + 6 + 24);  // every state twice, every reference once
  for (int cancel_at = 1; cancel_at <= all; cancel_at += 5) count_questions(cancel_at);
}

// Learning, most of the time of a bake, could not be cancelled: the bake went on and replaced the existing model.
TEST_CASE("a bake can be cancelled while it learns from depth images") {
  const auto count_questions = [](int cancel_at) {
    const TemporaryFolder folder;
    int questions = 0;
    BakeOptions options = with_views(1);
    options.cancelled = [&] { return ++questions == cancel_at; };
    const auto bake = [&] { bake_model(similar_plates(4, 3), bent_plates_description(), folder / "m.lbea", options); };
    if (cancel_at == 0) {
      bake();
    } else {
      CHECK_THROWS_AS(bake(), BakeCancelled);
      CHECK(std::filesystem::is_empty(folder.path()));
    }
    return questions;
  };
  const int all = count_questions(0), before = 2 * 4 * 3 + 1;  // every state twice, the reference
  REQUIRE(all >= 4 * before);
  for (int cancel_at = all; cancel_at > before; cancel_at -= (all - before) / 6) count_questions(cancel_at);
}

TEST_CASE("progress counts every stage to its end") {
  const TemporaryFolder folder;
  std::map<std::string, std::vector<std::uint64_t>> seen;
  BakeOptions options;
  options.progress = [&](const BakeProgress& progress) {
    seen[std::string(progress.stage)].push_back(progress.done);
    CHECK(progress.done <= progress.total);
  };
  bake_model(bent_plates(), bent_plates_description(ReferenceMode::over_time), folder / "m.lbea", options);
  CHECK(seen["reading"].back() == 4);
  CHECK(seen["bases"].back() == 6);
  CHECK(seen["samples"].back() == 24);
  for (const auto& [stage, counts] : seen) CHECK(std::ranges::is_sorted(counts));
}

TEST_CASE("a missing output folder is reported as write_failed") {
  const TemporaryFolder folder;
  CHECK_THROWS_WITH_AS(bake_bent_plates(folder.path() / "none" / "m.lbea"), doctest::Contains("cannot create"), Error);
}

// Regression: displacements under an unknown name were ignored, and runs that did not move were baked without a word.
TEST_CASE("a run that does not move is reported") {
  const TemporaryFolder folder;
  Ensemble ensemble;
  for (const double angle : {0.5, 0.0})
    ensemble.runs.push_back({"plate_" + std::to_string(ensemble.runs.size()), {}, [angle] {
                               return std::make_unique<SyntheticSimulation>(bending_plate(angle, 4));
                             }});
  const BakeSummary summary = bake_model(ensemble, bent_plates_description(), folder / "m.lbea", {});
  REQUIRE(summary.warnings.size() == 1);
  CHECK(contains(summary.warnings[0], "run plate_1: no node moves"));
}
