#include "tests/runtime/fit/seen_plates.hpp"

#include <lbea/components.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// Runs plate_0, plate_1, ... in this order.
AlignedBytes plates_in_order(const std::vector<std::size_t>& order, std::uint32_t steps = 8, double time_factor = 1) {
  const TemporaryFolder folder;
  Ensemble all = similar_plates(6, steps), ensemble;
  for (const std::size_t run : order) ensemble.runs.push_back(all.runs[run]);
  EnsembleDescription description = bent_plates_description();
  description.time_factor = time_factor;
  bake_model(ensemble, description, folder / "plates.lbea", with_views());
  return AlignedBytes(folder / "plates.lbea");
}

/// Three runs that bend up, and three that bend down.
AlignedBytes plates_up_and_down() {
  const TemporaryFolder folder;
  Ensemble ensemble = similar_plates(3, 8);
  for (int run = 0; run < 3; ++run)
    ensemble.runs.push_back({"down_" + std::to_string(run), {}, [run] {
                               return std::make_unique<SyntheticSimulation>(bending_plate(-0.5 - 0.1 * run, 8));
                             }});
  bake_model(ensemble, bent_plates_description(), folder / "plates.lbea", with_views());
  return AlignedBytes(folder / "plates.lbea");
}

/// What a frame is to a component, by the name of the run and the time step.
using Residual = std::function<float(std::string_view run, std::uint32_t step)>;

struct Evidence {
  std::vector<Match> candidates;
  std::vector<float> ranks;
  MatchResult result;

  Evidence(const Model& model, const Residual& residual, std::size_t most = 1000) {
    for (std::uint32_t s = 0; s < model.samples(); ++s) {
      const Sample sample = model.sample(s);
      candidates.push_back({sample, residual(model.simulation_name(sample.simulation), sample.time_step)});
    }
    std::ranges::stable_sort(candidates, {}, &Match::distance);
    candidates.resize(std::min(most, candidates.size()));
    for (const Match& candidate : candidates) ranks.push_back(candidate.distance);
    result.fit.candidates = candidates;
    result.fit.ranks = ranks;
    result.fit.misfit = 1;
  }
  Evidence(const Evidence&) = delete;
};

float apart(std::uint32_t a, std::uint32_t b) { return std::abs(static_cast<float>(a) - static_cast<float>(b)); }

/// Prefers these runs, which it cannot tell apart, at this step.
Residual like(const std::vector<std::string>& runs, std::uint32_t now, float others = 1.6f) {
  return [=](std::string_view run, std::uint32_t step) {
    return (std::ranges::find(runs, run) != runs.end() ? 1.0f : others) + 0.4f * apart(step, now);
  };
}

/// With random errors, the same for the same seed.
Residual scattered(const Residual& residual, unsigned seed) {
  return [=](std::string_view run, std::uint32_t step) {
    std::mt19937 random(seed + step + 100 * static_cast<unsigned>(run.back() - '0'));
    return residual(run, step) * std::uniform_real_distribution<float>(0.9f, 1.1f)(random);
  };
}

bool same(std::span<const float> a, std::span<const float> b) { return std::ranges::equal(a, b); }

void check_same(const TestState& a, const TestState& b) {
  CHECK(a.frames == b.frames);
  CHECK(a.sample == b.sample);
  CHECK(a.sample_probability == b.sample_probability);
  CHECK(a.simulation == b.simulation);
  CHECK(same(a.simulation_probabilities, b.simulation_probabilities));
  CHECK(same(a.branch_probabilities, b.branch_probabilities));
  CHECK(a.misfit == b.misfit);
  CHECK(a.verdict == b.verdict);
}

MatchResult with_status(MatchResult result, Status status) {
  result.status = status;
  return result;
}

void update(ComponentTracker& tracker, const std::vector<MatchResult>& results) { tracker.update(results); }

/// A test with a phase before the impact, low coverage and refused frames.
MatchResult frame_of_test(const Evidence& evidence, std::uint32_t frame) {
  return with_status(evidence.result, frame % 7 == 5   ? Status::low_coverage
                                      : frame % 7 == 6 ? Status::empty_frame
                                                       : Status::ok);
}
std::uint32_t step_at(std::uint32_t frame) { return frame < 4 ? 0 : std::min((frame - 2) / 2, 7u); }

std::string named(const Model& model, const TestState& state) {
  return std::string(model.simulation_name(state.simulation));
}

}  // namespace

TEST_CASE("one component is tracked as by Tracker, to the last bit") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  ComponentTracker components({{model}});
  REQUIRE(components.components() == 1);
  for (int test = 0; test < 2; ++test) {
    for (std::uint32_t frame = 0; frame < 24; ++frame) {
      const Evidence evidence(model, scattered(like({"plate_2"}, step_at(frame)), frame), 12);
      const MatchResult result = frame_of_test(evidence, frame);
      update(components, {result});
      check_same(components.state(0), tracker.update(result));
    }
    CHECK(components.state(0).frames > 10);
    tracker.reset();
    components.reset();
    check_same(components.state(0), tracker.state());
  }
}

TEST_CASE("a component that sees nothing takes nothing away: the others are tracked as alone, to the last bit") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5}), reversed = plates_in_order({5, 4, 3, 2, 1, 0});
  const Model model = Model::view(bytes.span()), blind = Model::view(reversed.span());
  Tracker tracker(model);
  ComponentTracker components({{model}, {blind}});
  for (std::uint32_t frame = 0; frame < 24; ++frame) {
    const Evidence evidence(model, scattered(like({"plate_2"}, step_at(frame)), frame), 12);
    const Evidence wrong(blind, like({"plate_5"}, 7));
    MatchResult nothing = wrong.result;
    if (frame % 3 == 0) nothing = {};                          // no candidates
    if (frame % 3 == 1) nothing.status = Status::empty_frame;  // refused
    if (frame % 3 == 2) nothing.status = Status::too_many_points;
    const MatchResult result = frame_of_test(evidence, frame);
    update(components, {result, nothing});
    check_same(components.state(0), tracker.update(result));
    CHECK(components.state(1).verdict == Verdict::unknown);
    CHECK(components.state(1).misfit == 0);
    CHECK(named(blind, components.state(1)) == named(model, components.state(0)));
  }
}

TEST_CASE("low coverage is no evidence beside a component that is seen") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  ComponentTracker components({{model}, {model}});
  for (std::uint32_t frame = 0; frame < 12; ++frame) {
    const Evidence evidence(model, scattered(like({"plate_2"}, step_at(frame)), frame), 12);
    const Evidence wrong(model, like({"plate_5"}, 7));
    update(components, {evidence.result, with_status(wrong.result, Status::low_coverage)});
    const TestState& alone = tracker.update(evidence.result);
    CHECK(components.state(0).sample == alone.sample);
    CHECK(same(components.state(0).simulation_probabilities, alone.simulation_probabilities));
  }
  const Evidence only(model, like({"plate_4"}, 6));
  update(components, {{}, with_status(only.result, Status::low_coverage)});
  CHECK(model.simulation_name(components.state(0).sample.simulation) == "plate_4");
}

TEST_CASE("where one component cannot tell the runs apart, the answer is that of the other") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  for (const bool is_first : {false, true}) {
    Tracker tracker(model);
    ComponentTracker components({{model}, {model}});
    for (std::uint32_t frame = 0; frame < 12; ++frame) {
      const Evidence evidence(model, scattered(like({"plate_3"}, step_at(frame)), frame), 12);
      const Evidence alike(model, [](std::string_view, std::uint32_t) { return 2.0f; });
      update(components,
             is_first ? std::vector{evidence.result, alike.result} : std::vector{alike.result, evidence.result});
      const TestState &both = components.state(0), &alone = tracker.update(evidence.result);
      CHECK(both.sample == alone.sample);
      for (std::uint32_t i = 0; i < model.simulations(); ++i)
        CHECK(both.simulation_probabilities[i] == doctest::Approx(alone.simulation_probabilities[i]).epsilon(1e-4));
    }
    CHECK(named(model, components.state(0)) == "plate_3");
  }
}

// Each component confuses the true run with another one, also in every single frame.
TEST_CASE("evidence adds up: the only run that all components support is named") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  ComponentTracker components({{model}, {model}, {model}});
  int right = 0;
  for (std::uint32_t frame = 0; frame < 12; ++frame) {
    const std::uint32_t step = step_at(frame);
    const Evidence a(model, scattered(like({"plate_1", "plate_2"}, step), frame)),
        b(model, scattered(like({"plate_2", "plate_4"}, step), frame + 50)),
        c(model, scattered(like({"plate_2", "plate_5"}, step), frame + 70));
    update(components, {a.result, b.result, c.result});
    const Sample sample = components.state(1).sample;
    right += model.simulation_name(sample.simulation) == "plate_2" && sample.time_step == step ? 1 : 0;
  }
  CHECK(right == 12);
  CHECK(named(model, components.state(2)) == "plate_2");
  CHECK(components.state(0).simulation_probabilities[2] > 0.99f);
}

TEST_CASE("contradictory evidence counts the same, whichever component it comes from") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  ComponentTracker components({{model}, {model}}), exchanged({{model}, {model}});
  for (std::uint32_t frame = 2; frame < 12; ++frame) {
    const Evidence a(model, like({"plate_1"}, step_at(frame))), b(model, like({"plate_3"}, step_at(frame)));
    update(components, {a.result, b.result});
    update(exchanged, {b.result, a.result});
    const auto p = components.state(0).simulation_probabilities, q = exchanged.state(1).simulation_probabilities;
    CHECK(p[1] == doctest::Approx(p[3]).epsilon(1e-4));
    CHECK(p[1] > p[0]);
    for (std::size_t i = 0; i < p.size(); ++i) CHECK(p[i] == doctest::Approx(q[i]).epsilon(1e-4));
    CHECK(components.state(0).sample == exchanged.state(0).sample);
  }
}

TEST_CASE("runs in another order are the same runs") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5}), shuffled = plates_in_order({3, 0, 5, 2, 1, 4});
  const Model model = Model::view(bytes.span()), other = Model::view(shuffled.span());
  CHECK(difference_of_runs(model, other).empty());
  ComponentTracker same_order({{model}, {model}}), other_order({{model}, {other}});
  for (std::uint32_t frame = 0; frame < 16; ++frame) {
    const Residual of_a = scattered(like({"plate_1", "plate_2"}, step_at(frame)), frame),
                   of_b = scattered(like({"plate_2", "plate_4"}, step_at(frame)), frame + 50);
    const Evidence a(model, of_a, 20), b(model, of_b, 20), b_other(other, of_b, 20);
    update(same_order, {a.result, b.result});
    update(other_order, {a.result, b_other.result});
    const TestState &first = other_order.state(0), &second = other_order.state(1);
    check_same(first, same_order.state(0));
    CHECK(named(other, second) == named(model, first));
    CHECK(other.simulation_name(second.sample.simulation) == model.simulation_name(first.sample.simulation));
    CHECK(second.sample.time_step == first.sample.time_step);
    for (std::uint32_t i = 0; i < other.simulations(); ++i)
      for (std::uint32_t j = 0; j < model.simulations(); ++j)
        if (other.simulation_name(i) == model.simulation_name(j))
          CHECK(second.simulation_probabilities[i] == first.simulation_probabilities[j]);
    float branches = 0;
    for (const float p : second.branch_probabilities) branches += p;
    CHECK(branches == doctest::Approx(1).epsilon(1e-4));
  }
}

TEST_CASE("each component has its own misfit and verdict") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  ComponentTracker components({{model}, {model}});
  for (std::uint32_t frame = 0; frame < 12; ++frame) {
    Evidence a(model, like({"plate_2"}, step_at(frame))), b(model, like({"plate_2"}, step_at(frame)));
    b.result.fit.misfit = 9;
    update(components, {a.result, b.result});
  }
  CHECK(components.state(0).misfit == doctest::Approx(1));
  CHECK(components.state(1).misfit == doctest::Approx(9));
  CHECK(components.state(0).verdict == Verdict::matched);
  CHECK(components.state(1).verdict == Verdict::no_simulation_fits);
}

TEST_CASE("what only other components tell of one is no verdict") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  ComponentTracker components({{model}, {model}});
  for (std::uint32_t frame = 0; frame < 12; ++frame) {
    const Evidence seen(model, like({"plate_2"}, step_at(frame))), hardly(model, like({"plate_5"}, step_at(frame)));
    update(components, {seen.result, with_status(hardly.result, Status::low_coverage)});
  }
  CHECK(components.state(0).verdict == Verdict::matched);
  CHECK(components.state(1).verdict == Verdict::unknown);
  components.reset();
  CHECK(components.state(0).verdict == Verdict::unknown);
}

// Rear and front of different runs were "matched" by the run of the one that told more.
TEST_CASE("a component that shows another branch than the others is ambiguous") {
  const AlignedBytes bytes = plates_up_and_down();
  const Model model = Model::view(bytes.span());
  REQUIRE(model.branches() == 2);
  ComponentTracker components({{model}, {model}});
  const auto play = [&](const std::string& run_of_second) {
    components.reset();
    for (std::uint32_t frame = 0; frame < 16; ++frame) {
      const Evidence first(model, like({"plate_2"}, step_at(frame), 9)),
          second(model, like({run_of_second}, step_at(frame), 1.95f));
      update(components, {first.result, second.result});
    }
    CAPTURE(run_of_second);
    CHECK(named(model, components.state(0)) == "plate_2");
    CHECK(components.state(0).verdict == Verdict::matched);
    return components.state(1).verdict;
  };
  CHECK(play("plate_2") == Verdict::matched);
  CHECK(play("plate_1") == Verdict::matched);  // another run of the branch
  CHECK(play("down_1") == Verdict::ambiguous);
}

TEST_CASE("any number of frames before the impact counts as one for each component") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  const auto probabilities_after = [&](int frames) {
    ComponentTracker components({{model}, {model}});
    for (int frame = 0; frame < frames; ++frame) {
      const Evidence a(model, like({"plate_2", "plate_3"}, 0, 1.1f)), b(model, like({"plate_3"}, 0, 1.1f));
      update(components, {a.result, b.result});
    }
    const auto p = components.state(0).simulation_probabilities;
    return std::vector<float>(p.begin(), p.end());
  };
  const std::vector<float> once = probabilities_after(1), often = probabilities_after(200);
  for (std::size_t i = 0; i < once.size(); ++i) CHECK(often[i] == doctest::Approx(once[i]).epsilon(1e-3));
  CHECK(once[3] > once[2]);
  CHECK(once[2] > once[1]);
}

TEST_CASE("missing results and forged candidates are no evidence") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3, 4, 5});
  const Model model = Model::view(bytes.span());
  ComponentTracker components({{model}, {model}});
  components.update({});
  CHECK(components.state(0).frames == 0);
  const Evidence evidence(model, like({"plate_1"}, 3));
  const std::vector<Match> forged{{{1000, 1}, 1.0f}, {{0, 99}, 1.0f}, {{2, 3}, std::nanf("")}};
  MatchResult from_elsewhere;
  from_elsewhere.fit.candidates = forged;
  update(components, {from_elsewhere, evidence.result, evidence.result});  // one more than components
  CHECK(components.state(0).frames == 1);
  CHECK(named(model, components.state(1)) == "plate_1");
  Tracker alone(model);
  check_same(components.state(1), alone.update(evidence.result));
}

TEST_CASE("models with different runs, time steps or times are not coupled, and the sentence says why") {
  const AlignedBytes bytes = plates_in_order({0, 1, 2, 3}), fewer = plates_in_order({0, 1, 2}),
                     shorter = plates_in_order({3, 2, 1, 0}, 7), slower = plates_in_order({0, 1, 2, 3}, 8, 2);
  const Model model = Model::view(bytes.span());
  const auto check_refused = [&](const AlignedBytes& other, const std::string& why) {
    const Model second = Model::view(other.span());
    CHECK_MESSAGE(difference_of_runs(model, second).find(why) != std::string::npos, difference_of_runs(model, second));
    CHECK_MESSAGE(difference_of_runs(second, model).find(why) != std::string::npos, difference_of_runs(second, model));
    CHECK_THROWS_AS(ComponentTracker({{model}, {second}}), Error);
  };
  check_refused(fewer, "only one of the models has the run \"plate_3\"");
  check_refused(shorter, "only one of the models has time step 7 of run");
  check_refused(slower, "different times for time step 1 of run");
  CHECK_THROWS_AS(ComponentTracker({}), Error);
  CHECK_THROWS_AS(ComponentTracker({{model}}, {.change = 2}), Error);
}
