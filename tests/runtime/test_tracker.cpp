#include "tests/support/synthetic_model.hpp"

#include <lbea/tracker.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

/// A result whose candidates are all samples, with the residuals that `residual` gives.
struct Evidence {
  std::vector<Match> candidates;
  MatchResult result;

  Evidence(const Model& model, const std::function<float(Sample)>& residual) {
    for (std::uint32_t s = 0; s < model.samples(); ++s)
      candidates.push_back({model.sample(s), residual(model.sample(s))});
    std::ranges::sort(candidates, {}, &Match::distance);
    result.fit.candidates = candidates;
    result.matches = candidates;
  }
};

float apart(float value, float from) { return std::abs(value - from); }

}  // namespace

TEST_CASE("probabilities add up to 1, by simulations and by branches, before and after any frame") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  for (int frame = 0; frame < 10; ++frame) {
    const auto sum = [](std::span<const float> p) { return std::accumulate(p.begin(), p.end(), 0.0f); };
    CHECK(sum(tracker.state().simulation_probabilities) == doctest::Approx(1).epsilon(1e-4));
    CHECK(sum(tracker.state().branch_probabilities) == doctest::Approx(1).epsilon(1e-4));
    tracker.update(Evidence(model, [&](Sample s) {
                     return 1 + apart(static_cast<float>(s.time_step), static_cast<float>(frame) / 2);
                   }).result);
  }
  CHECK(tracker.state().frames == 10);
}

TEST_CASE("the simulation that explains the whole test wins, though another looks better in a few frames") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  for (int frame = 0; frame < 12; ++frame) {
    const float step = static_cast<float>(frame) / 2;
    tracker.update(Evidence(model, [&](Sample s) {
                     const float own = s.simulation == 2 ? 0.0f : 1.5f;
                     const float lure = frame < 2 && s.simulation == 1 ? -2.0f : 0.0f;  // a wrong start
                     return std::max(0.3f, 2 + own + lure + 2 * apart(static_cast<float>(s.time_step), step));
                   }).result);
  }
  CHECK(tracker.state().simulation == 2);
  CHECK(tracker.state().simulation_probabilities[2] > 0.9f);
  CHECK(tracker.state().sample.simulation == 2);
}

TEST_CASE("time does not run backwards: a frame that looks like an earlier step moves nothing back") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Tracker tracker(model, {.change = 0});
  const auto frame_at = [&](float step) {
    return Evidence(model, [&](Sample s) {
      return (s.simulation == 0 ? 0.5f : 60.0f) + 3 * apart(static_cast<float>(s.time_step), step);
    });
  };
  for (const float step : {0.0f, 1.0f, 2.0f, 4.0f}) tracker.update(frame_at(step).result);
  REQUIRE(tracker.state().sample == Sample{0, 4});
  tracker.update(frame_at(1).result);
  CHECK(tracker.state().sample.time_step >= 4);
}

TEST_CASE("clocks at any rate and offset end at the same sample") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  for (const float steps_per_frame : {0.02f, 0.3f, 1.0f, 2.5f}) {
    CAPTURE(steps_per_frame);
    Tracker tracker(model);
    float last = 0;
    for (float step = 1; step <= 5; last = step, step += steps_per_frame)
      tracker.update(Evidence(model, [&](Sample s) {
                       return 0.2f + (s.simulation == 3 ? 0.0f : 3.0f) +
                              2 * apart(static_cast<float>(s.time_step), step);
                     }).result);
    CHECK(tracker.state().simulation == 3);
    CHECK(apart(static_cast<float>(tracker.state().sample.time_step), last) <= 0.51f);
  }
}

TEST_CASE("refused frames say nothing, and a reset forgets") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  MatchResult refused;
  refused.status = Status::empty_frame;
  tracker.update(refused);
  CHECK(tracker.state().frames == 0);
  tracker.update(Evidence(model, [](Sample s) { return s == Sample{1, 3} ? 0.1f : 9.0f; }).result);
  CHECK(tracker.state().simulation == 1);
  tracker.reset();
  CHECK(tracker.state().frames == 0);
  CHECK(tracker.state().simulation_probabilities[1] == doctest::Approx(1.0 / model.simulations()));
}

TEST_CASE("nonsense in the configuration is refused by name") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  for (const TrackerConfig& config : {TrackerConfig{.sharpness = 0}, TrackerConfig{.noise = -1},
                                      TrackerConfig{.persistence = 1}, TrackerConfig{.change = 1.5f}})
    CHECK_THROWS_AS(Tracker(model, config), Error);
}

TEST_CASE("the path after the test is the best of all paths: as brute force finds it, over a model small enough") {
  const AlignedBytes bytes = bent_plates_model(ReferenceMode::impact, {.runs = 2, .steps = 3});
  const Model model = Model::view(bytes.span());
  const TrackerConfig config{.sharpness = 0.5f, .noise = 0.5f, .change = 0.1f};
  std::mt19937 random(3);
  std::uniform_real_distribution<float> residual(0.5f, 3);
  for (int trial = 0; trial < 20; ++trial) {
    std::vector<std::vector<Match>> evidence;
    for (int frame = 0; frame < 4; ++frame)
      evidence.push_back(Evidence(model, [&](Sample) { return residual(random); }).candidates);
    const auto path = likeliest_path(model, evidence, config);
    REQUIRE(path.size() == evidence.size());
    // Every pure path, one that stays in its simulation and never goes back, is no likelier.
    const auto log_likelihood = [&](const std::vector<Sample>& samples) {
      double sum = 0;
      for (std::size_t f = 0; f < samples.size(); ++f) {
        const double best = double{evidence[f][0].distance} * double{evidence[f][0].distance};
        for (const Match& m : evidence[f])
          if (m.sample == samples[f])
            sum += std::max(-0.5 * (double{m.distance} * double{m.distance} - best) /
                                (best + double{config.noise} * double{config.noise}),
                            std::log(1e-9));
        if (f == 0) continue;
        const Sample a = samples[f - 1], b = samples[f];
        const bool forward = a.simulation == b.simulation && b.time_step >= a.time_step;
        const double within = forward ? std::log(1 - double{config.change}) +
                                            (b.time_step - a.time_step) * std::log(double{config.persistence}) +
                                            std::log(1 - double{config.persistence})
                                      : -1e9;
        const double change = b.time_step >= a.time_step ? std::log(double{config.change} / model.samples()) : -1e9;
        sum += std::max(within, change);
      }
      return sum;
    };
    const double found = log_likelihood(path);
    for (std::uint32_t simulation = 0; simulation < 2; ++simulation)
      for (std::uint32_t a = 0; a < 3; ++a)
        for (std::uint32_t b = a; b < 3; ++b)
          for (std::uint32_t c = b; c < 3; ++c)
            for (std::uint32_t d = c; d < 3; ++d)
              CHECK(found >=
                    log_likelihood({{simulation, a}, {simulation, b}, {simulation, c}, {simulation, d}}) - 1e-5);
    for (std::size_t f = 1; f < path.size(); ++f) CHECK(path[f].time_step >= path[f - 1].time_step);
  }
  CHECK(likeliest_path(model, {}, config).empty());
}
