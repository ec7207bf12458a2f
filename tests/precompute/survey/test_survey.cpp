#include "precompute/survey/run_checks.hpp"

#include "tests/support/synthetic_simulation.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using Steps = std::vector<std::uint32_t>;

namespace {
constexpr std::uint32_t end = StepSelection{}.last;
}

TEST_CASE("steps: all, a range with stride, a list") {
  CHECK(used_steps({}, 3, "a") == Steps{0, 1, 2});
  CHECK(used_steps({1, 9, 3, {}}, 6, "a") == Steps{1, 4});
  CHECK(used_steps({2, 2, 1, {}}, 6, "a") == Steps{2});
  CHECK(used_steps({0, end, 0xffffffff, {}}, 6, "a") == Steps{0});
  CHECK(used_steps({0, end, 1, {4, 0, 4}}, 5, "a") == Steps{0, 4});
}

TEST_CASE("the error about missing steps names the run") {
  CHECK_THROWS_WITH_AS((void)used_steps({0, end, 1, {1, 5}}, 5, "a"), doctest::Contains("run a has no state 5, only 5"),
                       Error);
  CHECK_THROWS_WITH_AS((void)used_steps({5, end, 1, {}}, 5, "a"),
                       doctest::Contains("no state of run a is used: it has 5"), Error);
  CHECK_THROWS_WITH_AS((void)used_steps({}, 0, "a"), doctest::Contains("it has 0"), Error);
  CHECK_THROWS_WITH_AS((void)used_steps({0, end, 0, {}}, 5, "a"), doctest::Contains("stride"), Error);
}

TEST_CASE("a missing state shifted the later ones without a word: unequal intervals are named") {
  const auto warning = [](const Steps& steps, const std::vector<double>& times) {
    return irregular_times({steps, times, {}, {}, {}}, "a").value_or("");
  };
  CHECK(warning({0, 1, 2, 3, 4}, {0, 1e-3, 2e-3, 3e-3, 4e-3}).empty());
  CHECK(warning({0, 1, 2, 3, 4}, {0, 1.01e-3, 2e-3, 3e-3, 3.2e-3}).empty());  // whole time steps, and the end
  CHECK(warning({0, 4, 6, 8}, {0, 4e-3, 6e-3, 8e-3}).empty());                // chosen states
  CHECK(warning({0, 1, 2, 3, 4}, {0, 1e-3, 3e-3, 4e-3, 5e-3}) ==
        "run a: state 2 comes 0.002 s after the one before it, most others 0.001 s; is a state missing?");
}

TEST_CASE("a run in another place, unit or numbering than the reference run is named") {
  const SimulationMesh reference = test::plate_mesh();  // 190 x 90
  const auto doubt = [&](double scale, float shift) {
    SimulationMesh mesh = reference;
    for (float& x : mesh.positions) x = static_cast<float>(scale) * x + shift;
    return misfit(reference, mesh, "a", "mm");
  };
  const auto has = [](const std::string& text, const char* part) { return text.find(part) != std::string::npos; };
  CHECK(doubt(1, 0).empty());
  CHECK(doubt(1.05, 5).empty());  // a variant, started elsewhere
  CHECK(has(doubt(1, 700), "half of its nodes lie more than 1212 mm"));
  CHECK(has(doubt(1, 700), "whose mesh measures 210.2 mm; is it in another coordinate system"));
  CHECK(has(doubt(1000, 0), "is the run in mm and the reference run in m?"));
  CHECK(has(doubt(0.001, 0), "is the run in m and the reference run in mm?"));
  CHECK(has(doubt(1 / 25.4, 0), "is the run in inches and the reference run in mm?"));
}

TEST_CASE("meshes of different sizes without ids are refused unless they lie at the same place") {
  SimulationMesh reference = test::plate_mesh({20, 10, 190, 90}), finer = test::plate_mesh({25, 12, 190, 90}),
                 longer = reference;
  CHECK_FALSE(misfit(reference, finer, "a", "mm").empty());  // the numbers are the files' own: a doubt
  finer.has_solver_ids = false;
  CHECK_THROWS_WITH_AS(static_cast<void>(misfit(reference, finer, "a", "mm")),
                       doctest::Contains("run a: its mesh of 300 nodes is not that of the reference run (200 nodes)"),
                       Error);
  longer.has_solver_ids = false;
  longer.node_ids.push_back(9999);
  longer.positions.insert(longer.positions.end(), {0, 0, 50});
  CHECK(misfit(reference, longer, "a", "mm").empty());
}

// Regression: a run in another time unit, and one that began later, were baked without a word.
TEST_CASE("runs with other times than most are listed in one line") {
  Survey survey;
  const std::vector<std::string> names{"a", "b", "c", "d", "e"};
  const auto add = [&](double begin, double end) {
    survey.runs.push_back({.steps = {0, 1}, .times_s = {begin, end}, .fields = {}, .histories = {}, .files = {}});
  };
  for (const double end : {0.015, 0.02, 0.012}) add(0, end);
  CHECK_FALSE(odd_times(survey, names));
  add(0, 15);
  add(0.01, 0.025);
  CHECK(odd_times(survey, names) ==
        "other times than most runs (0 s to 0.015 s): d (0 s to 15 s), e (0.01 s to 0.025 s); check their time unit, "
        "and that time 0 is the impact in all runs");
}

TEST_CASE("runs that are shorter than most are listed in one line") {
  Survey survey;
  const std::vector<std::string> names{"a", "b", "c", "d"};
  const auto add = [&](std::uint32_t states, double interval) {
    RunSurvey run;
    for (std::uint32_t i = 0; i < states; ++i) {
      run.steps.push_back(i);
      run.times_s.push_back(interval * i);
    }
    survey.runs.push_back(run);
  };
  add(20, 1e-3);
  add(20, 1e-3);
  add(19, 1e-3);
  CHECK_FALSE(short_runs(survey, names));
  CHECK_FALSE(missing_last(survey, names, {}));
  CHECK_FALSE(missing_last(survey, names, {0, 18, 1, {}}));
  CHECK(missing_last(survey, names, {0, 19, 1, {}}) ==
        "the steps go up to state 19, but these runs end before it: c (18)");
  CHECK_FALSE(missing_last(survey, names, {0, 19, 2, {}}));
  add(2, 1e-3);
  CHECK(short_runs(survey, names) ==
        "fewer states or an earlier end than most runs (20 states up to 0.019 s): d (2 states up to 0.001 s); are they "
        "complete?");
}
