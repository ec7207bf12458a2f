// What experiments are compared with: fields, results, meshes, ICP.
#include "adapters/simulation/open.hpp"
#include "runtime/src/track/inference.hpp"
#include "tests/mapping/meshes.hpp"
#include "tests/support/eroding_plates.hpp"
#include "tests/support/files.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/eval/evaluation.hpp"
#include "tools/eval/experiments.hpp"
#include "tools/eval/icp_baseline.hpp"
#include "tools/eval/live.hpp"
#include "tools/eval/mesh_series.hpp"
#include "tools/eval/truth.hpp"

#include <lbea/inference.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <sstream>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::io;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

struct Plates {
  TemporaryFolder folder;
  Model model = opened();

 private:
  [[nodiscard]] Model opened() const {
    bake_bent_plates(folder / "plates.lbea");
    return Model::open(folder / "plates.lbea");
  }
};

}  // namespace

TEST_CASE("samples without a number at an element do not count; with half of the weight, none is the result") {
  const std::vector<float> a{1, NAN, NAN, 1}, b{3, 3, NAN, NAN}, c{5, 5, 4, 4};
  const std::vector<WeightedRow> rows{{a, 0.5f}, {b, 0.25f}, {c, 0.25f}};
  std::vector<float> m, spread;
  weighted_mean(rows, m);
  CHECK(m[0] == 2.5f);
  CHECK(std::isnan(m[1]));  // exactly half is not more than half of it
  CHECK(std::isnan(m[2]));
  CHECK(m[3] == 2);  // (0.5 * 1 + 0.25 * 4) / 0.75
  weighted_spread(rows, m, 1, spread);
  CHECK(std::isnan(spread[2]));
  CHECK(spread[3] == doctest::Approx(std::sqrt((0.5 * 1 + 0.25 * 4) / 0.75)));
  Inferred inferred;
  infer(std::vector<WeightedRow>{{a, -0.25f}, {b, 0.75f}, {c, 0.5f}}, rows, 1, inferred);
  CHECK(inferred.mean[1] == doctest::Approx((0.75 * 3 + 0.5 * 5) / 1.25));
  CHECK(inferred.spread[1] == doctest::Approx(std::sqrt((0.8 * 0.8 + 1.2 * 1.2) / 2)));
}

TEST_CASE("the signs of a regression's weights do not decide whether an element is eroded") {
  const std::vector<float> a{NAN, 1, 1, 1}, b{3, NAN, 3, 3}, c{4, 4, NAN, 4};
  const std::vector<WeightedRow> rows{{a, 0.55f}, {b, 0.9f}, {c, -0.45f}}, plausible{{a, 0.2f}, {b, 0.4f}, {c, 0.4f}};
  std::vector<float> m;
  weighted_mean(rows, m);
  // The missing value as the mean of the others by the amounts of their weights.
  CHECK(m[0] == doctest::Approx(0.55 * (0.9 * 3 + 0.45 * 4) / 1.35 + 0.9 * 3 - 0.45 * 4));
  CHECK(m[1] == doctest::Approx(0.55 * 1 + 0.9 * (0.55 * 1 + 0.45 * 4) / 1.0 - 0.45 * 4));
  CHECK(m[2] == doctest::Approx(0.55 * 1 + 0.9 * 3 - 0.45 * (0.55 * 1 + 0.9 * 3) / 1.45));
  weighted_mean(std::vector<WeightedRow>{{a, 1.5f}, {b, -1.0f}, {c, 0.5f}}, m);
  CHECK(std::isnan(m[0]));  // exactly half of the amounts
  Inferred inferred;
  infer(rows, plausible, 1, inferred);
  for (std::size_t i = 0; i < 4; ++i) CHECK(std::isfinite(inferred.mean[i]) == std::isfinite(inferred.spread[i]));
  CHECK(std::isfinite(inferred.mean[0]));
}

TEST_CASE("an inferred element has a mean and a spread, or neither") {
  const std::vector<float> a{1, NAN, NAN}, b{3, 3, NAN}, c{5, NAN, 5};
  const std::vector<WeightedRow> b_and_c{{b, 0.75f}, {c, 0.25f}}, most_a{{a, 0.875f}, {b, 0.125f}}, only_a{{a, 1.0f}};
  Inferred inferred;
  infer(b_and_c, most_a, 1, inferred);
  CHECK(inferred.mean[1] == 3);
  CHECK(inferred.spread[1] == 0);  // of the plausible samples that have the element
  CHECK(std::isnan(inferred.mean[2]));
  CHECK(std::isnan(inferred.spread[2]));
  infer(b_and_c, only_a, 1, inferred);
  CHECK(std::isnan(inferred.mean[1]));
  CHECK(std::isnan(inferred.spread[1]));
  CHECK(inferred.mean[0] == 3.5f);
}

TEST_CASE("weighted mean and spread by their formulas") {
  const std::vector<float> a{1, 2, 3, 4, 5, 6}, b{3, 2, 1, 0, 5, 10};
  const std::vector<WeightedRow> rows{{a, 0.25f}, {b, 0.75f}};
  std::vector<float> m, spread;
  weighted_mean(rows, m);
  CHECK(m == std::vector<float>{2.5f, 2, 1.5f, 1, 5, 9});
  weighted_spread(rows, m, 1, spread);
  // Two values with weights w and 1 - w: |difference| sqrt(w (1 - w)).
  for (std::size_t i = 0; i < 6; ++i)
    CHECK(spread[i] == doctest::Approx(std::abs(a[i] - b[i]) * std::sqrt(0.25f * 0.75f)));
  weighted_spread(rows, m, 3, spread);
  CHECK(spread.size() == 2);
  CHECK(spread[0] == doctest::Approx(std::hypot(2.0, 0.0, 2.0) * std::sqrt(0.1875)));
  weighted_mean({}, m);
  CHECK(m.empty());
  weighted_spread({}, a, 1, spread);
  CHECK(spread == std::vector<float>(6, 0.0f));
  // About another value than the mean: never smaller.
  weighted_spread(rows, a, 1, spread);
  CHECK(spread[0] == doctest::Approx(2 * std::sqrt(0.75f)));
}

TEST_CASE("plausibilities sum to 1, decrease with the residual and ignore differences below the noise") {
  const Plates plates;
  const Model& model = plates.model;
  const std::vector<Match> candidates{{{0, 1}, 1.0f}, {{1, 2}, 1.0f}, {{2, 3}, 2.0f}};
  const auto weighted = plausible_samples(model, candidates, {.sharpness = 4, .noise = 1});
  CHECK(weighted[0].weight == weighted[1].weight);
  CHECK(weighted[2].weight / weighted[0].weight == doctest::Approx(std::exp(-4.0 * 3 / 2)));
  CHECK(weighted[0].weight + weighted[1].weight + weighted[2].weight == doctest::Approx(1));
  CHECK(weighted[2].sample == Sample{2, 3});
  CHECK(plausible_samples(model, {}).empty());
}

// Regression: a comma in the name of a run shifted the columns.
TEST_CASE("results.csv quotes names with commas and leaves cells without a value empty") {
  LiveRow row;
  row.result.frame_id = 7;
  row.result.matches.push_back({{0, 3}, "2.1 mm, steel", 0.003, 1.5f});
  row.error = 0.25;
  row.oracle_error = 0.125;
  LiveSummary summary;
  summary.rows.push_back(row);
  const TemporaryFolder folder;
  write_csv(folder / "results.csv", summary);
  const std::string text = text_of(folder / "results.csv");
  CAPTURE(text);
  CHECK(text.ends_with("\n7,0,ok,\"2.1 mm, steel\",3,1.5,0,0.25,0.125,0,0,unknown,unknown,,,,,,,,,,,,,,,\n"));
}

TEST_CASE("results.csv has a value and a bound per channel, in every frame under the same head") {
  LiveSummary summary;
  summary.rows.resize(3);  // the first frame was refused
  summary.rows[1].result.channels = {{{12.5f, 0.5f}, "end, \"x\"", "mm"}, {{-3, std::nanf("")}, "gap", ""}};
  summary.rows[2].result.channels = {{{4, 1}, "gap", ""}, {{7, 2}, "new", "m/s"}};
  const TemporaryFolder folder;
  write_csv(folder / "results.csv", summary);
  std::istringstream lines(text_of(folder / "results.csv"));
  std::array<std::string, 4> text;
  for (std::string& line : text) std::getline(lines, line);
  CHECK_MESSAGE(text[0].ends_with(",\"end, \"\"x\"\" [mm]\",\"end, \"\"x\"\" bound_90 [mm]\",gap,gap bound_90,"
                                  "new [m/s],new bound_90 [m/s]"),
                text[0]);
  CHECK(text[1].ends_with(",,,,,,"));
  CHECK(text[2].ends_with(",12.5,0.5,-3,,,"));
  CHECK(text[3].ends_with(",,,4,1,7,2"));
}

TEST_CASE("nodes of a run with the model's node numbers are found by number, those of a finer mesh by position") {
  const Plates plates;
  const Model& model = plates.model;
  const SimulationMesh same = plate_mesh();
  const TrueMesh by_number(same, model, {});
  CHECK(by_number.same_mesh());
  std::vector<float> positions;
  by_number.positions(same.positions, positions);
  CHECK(std::ranges::equal(positions, same.positions));
  // Runs of components that move as a whole may begin at other places.
  SimulationMesh moved = same;
  for (std::size_t i = 0; i < moved.positions.size(); i += 3) moved.positions[i] += 60;
  CHECK(TrueMesh(moved, model, {}).same_mesh());
  // Twice as fine, with some equal node numbers: every node of the model lies on a node or an edge of it.
  PlateShape finer;
  finer.columns = 2 * finer.columns - 1;
  finer.rows = 2 * finer.rows - 1;
  const SimulationMesh fine = plate_mesh(finer);
  const TrueMesh by_place(fine, model, {});
  CHECK(!by_place.same_mesh());
  const SimulationState bent = bent_state(fine, 0, 1.0, double{finer.length}),
                        expected = bent_state(same, 0, 1.0, double{finer.length});
  by_place.positions(bent.positions, positions);
  for (std::size_t i = 0; i < positions.size(); ++i)
    CHECK(positions[i] == doctest::Approx(expected.positions[i]).epsilon(1e-4));
}

TEST_CASE("the error of an experiment is that of the nodes that its run still has; meshes show what is eroded") {
  const Plates plates;
  const Model& model = plates.model;
  const SimulationMesh mesh = plate_mesh();
  SimulationState state;
  eroding_plate(0.8, 2, 1).read(1, state);
  hide_free_nodes(mesh, state.alive, state.positions);
  std::vector<float> truth;
  TrueMesh(mesh, model, {}).positions(state.positions, truth);
  CHECK(std::ranges::count_if(truth, [](float x) { return std::isnan(x); }) == 3 * 9);
  std::vector<float> sample = bent_state(mesh, 0, 0.8, 190).positions;
  for (std::size_t i = 1; i < sample.size(); i += 3) sample[i] += 2;
  sample[3 * patch_nodes()[4] + 2] = -1000;  // where the run has nothing
  CHECK(experiment_error(truth, sample) == doctest::Approx(2));
  CHECK(present_in(model, {{model.sample(0), 1.0f}}).empty());  // no sample of this model lacks elements
}

TEST_CASE("VTU files flag eroded elements when samples of the model lack some") {
  const TemporaryFolder folder;
  bake_model(eroding_plates(1, 2, 1), bent_plates_description(), folder / "m.lbea");
  const Model model = Model::open(folder / "m.lbea");
  MeshSeries series(model, folder.path());
  series.add_match("whole", 1, 0);
  series.add_match("hole", 3, 0.0005);
  for (const auto& [file, eroded] : {std::pair{"matched_whole.vtu", 0}, {"matched_hole.vtu", 16}}) {
    SimulationState state;
    open_simulation(folder / file)->read(0, state);
    CHECK(std::ranges::count(state.alive, 0) == eroded);
  }
  CHECK(eroded_in(model, {{model.sample(3), 0.6f}, {model.sample(1), 0.4f}}).size() == 16);
  CHECK(eroded_in(model, {{model.sample(3), 0.4f}, {model.sample(1), 0.6f}}).empty());
}

TEST_CASE("experiments with other meshes have the part ids that the ensemble's table says") {
  const TemporaryFolder folder;
  const auto row = [](const char* x) { return std::string("[[1,0,0,") + x + "],[0,1,0,45],[0,0,1,-600]]"; };
  const auto rig = put(folder / "sensor.json", "{\"T_reference_sensor\":" + row("95") +
                                                   ",\"sensor\":{\"focal_px\":300,\"width_px\":140,\"height_px\":"
                                                   "80,\"T_reference_right\":" +
                                                   row("155") + "}}");
  const auto run_of = [](const std::string& name, const SimulationMesh& mesh, double angle) {
    std::vector<SimulationState> states;
    for (std::uint32_t step = 0; step < 3; ++step)
      states.push_back(bent_state(mesh, 0.0005 * step, angle * step / 2, 190));
    const SyntheticSimulation run(mesh, states, {{"plastic_strain", "1"}});
    return EnsembleRun{name, {}, [run] { return std::make_unique<SyntheticSimulation>(run); }};
  };
  constexpr PlateShape coarse{20, 10, 190, 90}, fine{39, 19, 190, 90};
  const SimulationMesh mesh = two_plates(coarse, {1, 2});
  EvaluationPlan plan;
  plan.description = bent_plates_description();
  plan.description.mapping.parts = {{1, 2}, {2, 1}};
  plan.description.depth_sensor = rig;
  plan.ensemble = {{run_of("a", mesh, 0.2), run_of("b", mesh, 0.4)}, {}, 0};
  plan.splits = {{{0, 1}, {}}};
  const EnsembleRun other = run_of("other", two_plates(fine, {2, 1}), 0.4);
  plan.more_experiments = {{other.name, other.open}};
  plan.contained = plan.other_components = plan.icp = false;
  plan.trial.sensor = read_sensor_json(rig);
  plan.scratch = folder.path();
  plan.threads = 1;
  const Evaluation evaluation = evaluate(plan, {[](auto, auto, auto) {}, [] { return false; }});
  REQUIRE(evaluation.rounds.size() == 1);
  REQUIRE(evaluation.rounds[0].tests.size() == 1);
  // Run b bends as much; the plate of the other part is 2 mm away.
  for (const FrameTrial& frame : evaluation.rounds[0].tests[0].frames) CHECK(frame.best.error < 0.01);
}

TEST_CASE("ICP finds the sample that the points are from, also from an inaccurate pose") {
  const Plates plates;
  const Model& model = plates.model;
  const IcpBaseline icp(model);
  for (const std::uint32_t sample : {model.samples() - 1, model.samples() / 2 + 2}) {
    std::vector<std::array<double, 3>> points;
    const auto positions = model.node_positions(sample);
    for (const std::uint32_t node : model.vertex_nodes(0)) {
      const float* p = &positions[3 * std::size_t{node}];
      points.push_back({double{p[0]} + 1.5, double{p[1]} - 1, double{p[2]} + 0.5});
    }
    CHECK(icp.match(points).sample == sample);
    CHECK(icp.match(points).mean_squared_error <= icp.align((sample + 1) % model.samples(), points));
  }
}
