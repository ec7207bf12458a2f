#include "tests/runtime/fit/seen_plates.hpp"

#include <lbea/tracker.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <numeric>
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

TEST_CASE("refused frames change nothing, and a reset forgets all") {
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

namespace {

/// Two frames' worth of candidates: simulation 0 explained the first one better, simulation 1 the second one slightly.
struct TwoFrames {
  std::vector<Match> first{{{0, 1}, 1.0f}, {{1, 1}, 3.0f}}, second{{{0, 3}, 2.05f}, {{1, 4}, 2.0f}};
};

const TestState& update(Tracker& tracker, const std::vector<Match>& ranked) {
  MatchResult result;
  std::vector<float> ranks;
  for (const Match& m : ranked) ranks.push_back(m.distance);
  result.fit.candidates = ranked;
  result.fit.ranks = ranks;
  return tracker.update(result);
}

}  // namespace

TEST_CASE("the sample of a test is that of the frame, which fit has compared with the earlier ones") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  const TwoFrames frames;
  Tracker tracker(model);
  CHECK(update(tracker, frames.second).sample == Sample{1, 4});
  // exp(-8 (2.05^2 - 2^2) / (2^2 + 1^2)) for the other one
  CHECK(tracker.state().sample_probability == doctest::Approx(1 / (1 + std::exp(-8 * 0.2025 / 5))).epsilon(1e-4));
  tracker.reset();
  CHECK(update(tracker, frames.first).sample == Sample{0, 1});
  CHECK(update(tracker, frames.second).sample == Sample{1, 4});
}

// Regression: the sample had to follow a hidden Markov model, and a wrong history kept it from candidates that fit.
TEST_CASE("no history keeps the tracker from a sample that fits much better than all others") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  for (int frame = 0; frame < 50; ++frame) update(tracker, {{{0, 5}, 1.0f}, {{1, 5}, 3.0f}});
  CHECK(update(tracker, {{{0, 5}, 9.0f}, {{1, 2}, 1.0f}}).sample == Sample{1, 2});
}

// Forged candidates were written to beyond the tracker's arrays, and one rank that is not a number spoiled all frames.
TEST_CASE("candidates that the model does not contain, and numbers that are not finite, change nothing") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  const float infinity = std::numeric_limits<float>::infinity();
  Tracker tracker(model);
  update(tracker, {{{1000, 1}, 1.0f}, {{0, 99}, 1.0f}});
  CHECK(tracker.state().frames == 0);
  update(tracker, {{{0, 1}, std::nanf("")}, {{1, 1}, infinity}});
  CHECK(tracker.state().frames == 0);
  CHECK(update(tracker, {{{0, 1}, std::nanf("")}, {{1, 1}, 2.0f}, {{2, 1}, infinity}}).sample == Sample{1, 1});
  CHECK(update(tracker, {{{0, 2}, 4.0f}, {{1, 2}, 3.0f}, {{2, 2}, 1.0f}}).sample == Sample{2, 2});
  CHECK(tracker.state().sample_probability > 0.5f);
  CHECK(tracker.state().simulation_probabilities[0] >= 0);
  for (const float huge : {3e38f, 0.0f, 3e38f, 3e38f})
    CHECK(update(tracker, {{{0, 3}, huge}, {{1, 3}, 3.4e38f}}).sample_probability > 0.4f);  // was not a number
}

// The mean of the misfits was not a number from then on, and the verdict on the test `matched`.
TEST_CASE("a misfit that is not finite does not enter the verdict") {
  const AlignedBytes bytes = seen_plates_model(2, 4);
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  const Evidence evidence(model, [](Sample s) { return 1.0f + static_cast<float>(s.simulation); });
  const auto judged = [&](float misfit) {
    MatchResult result = evidence.result;
    result.fit.misfit = misfit;
    return tracker.update(result);
  };
  judged(std::numeric_limits<float>::infinity());
  judged(std::nanf(""));
  CHECK(tracker.state().misfit == 0);
  for (int frame = 0; frame < 4; ++frame) judged(9);
  CHECK(tracker.state().misfit == doctest::Approx(9));
  CHECK(tracker.state().verdict == Verdict::no_simulation_fits);
}

// A first frame with a misfit of 2.9, whose expected residual was a small part of the later ones', made a test with
// nine frames that fit one that no simulation fits.
TEST_CASE("a frame with a small expected residual does not decide on a test alone") {
  const AlignedBytes bytes = seen_plates_model(2, 10);
  const Model model = Model::view(bytes.span());
  DepthImages images = *SensorViews::baked_into(model).data();
  std::vector<float> expected(model.samples());
  for (std::uint32_t s = 0; s < model.samples(); ++s) expected[s] = model.sample(s).time_step == 1 ? 0.0f : 8.0f;
  images.expected = expected;
  Tracker tracker(model, {}, SensorViews(std::make_shared<const DepthImages>(images)));
  double logarithms = 0, weights = 0;
  for (std::uint32_t step = 1; step < 10; ++step) {
    Evidence evidence(model,
                      [&](Sample s) { return 1 + apart(static_cast<float>(s.time_step), static_cast<float>(step)); });
    evidence.result.fit.misfit = step == 1 ? 2.9f : 0.8f;
    const double weight = 1 / (std::pow(step == 1 ? 2.0 : 8.0, 2) + std::pow(double{images.metric.mesh_noise}, 2));
    logarithms += weight * std::log(double{evidence.result.fit.misfit});
    weights += weight;
    tracker.update(evidence.result);
  }
  CHECK(tracker.state().misfit == doctest::Approx(std::exp(logarithms / weights)).epsilon(1e-4));
  CHECK(tracker.state().misfit < 1.9f);  // was 2.5
}

// Ten frames before the impact turned `no simulation fits` into `matched`.
TEST_CASE("any number of frames before the impact counts as one in the misfit of a test") {
  const AlignedBytes bytes = seen_plates_model(2, 8);
  const Model model = Model::view(bytes.span());
  const auto misfit_after = [&](int frames_before) {
    Tracker tracker(model);
    const auto judge = [&](std::uint32_t step, float misfit) {
      Evidence evidence(model,
                        [&](Sample s) { return 1 + apart(static_cast<float>(s.time_step), static_cast<float>(step)); });
      evidence.result.fit.misfit = misfit;
      evidence.result.fit.residual = misfit;
      return tracker.update(evidence.result);
    };
    for (int frame = 0; frame < frames_before; ++frame) judge(0, 0.9f);
    for (std::uint32_t step = 1; step < 8; ++step) judge(step, 4);
    return tracker.state().misfit;
  };
  for (const int frames : {2, 10, 500}) CHECK(misfit_after(frames) == doctest::Approx(misfit_after(1)).epsilon(1e-4));
  CHECK(misfit_after(1) < misfit_after(0));
}

// All simulations begin with the same shape. A hundred frames of it, with the same errors, made one of them certain.
TEST_CASE("any number of frames before the impact counts as one in the probabilities of a test") {
  const AlignedBytes bytes = seen_plates_model(3, 8);
  const Model model = Model::view(bytes.span());
  const auto probabilities_after = [&](int frames_before, std::uint32_t last) {
    Tracker tracker(model);
    const auto update = [&](std::uint32_t step) {
      tracker.update(Evidence(model, [&](Sample s) {
                       return 1 + apart(static_cast<float>(s.time_step), static_cast<float>(step)) +
                              0.1f * static_cast<float>(s.simulation);
                     }).result);
    };
    for (int frame = 0; frame < frames_before; ++frame) update(frame == 7 ? 1 : 0);
    for (std::uint32_t step = 1; step <= last; ++step) update(step);
    const auto probabilities = tracker.state().simulation_probabilities;
    return std::vector<float>(probabilities.begin(), probabilities.end());
  };
  for (const std::uint32_t last : {0u, 3u}) {
    const std::vector<float> once = probabilities_after(1, last);
    for (const int frames : {2, 7, 100, 1000})
      for (std::size_t i = 0; i < once.size(); ++i)
        CHECK(probabilities_after(frames, last)[i] == doctest::Approx(once[i]).epsilon(1e-3));
  }
  CHECK(probabilities_after(1, 0)[0] > probabilities_after(1, 0)[1]);
}

namespace {

/// The hidden Markov model with all samples in each sum, as the tracker's header describes it.
class PlainTracker {
 public:
  explicit PlainTracker(const Model& model) : model_(model), p_(model.samples(), 1.0 / model.samples()) {}

  void update(const std::vector<Match>& candidates, bool is_first) {
    if (!is_first) predict();
    const double best = candidates.front().distance;
    const auto likelihood = [&](double r) {
      return std::max(std::exp(-config_.sharpness * (r * r - best * best) / (best * best + noise * noise)), 1e-9);
    };
    std::vector<double> weights(p_.size(), likelihood(candidates.back().distance));
    for (const Match& c : candidates) weights[model_.sample_index(c.sample)] = likelihood(c.distance);
    double all = 0;
    for (std::size_t s = 0; s < p_.size(); ++s) all += p_[s] *= weights[s];
    for (double& p : p_) p /= all;
  }
  [[nodiscard]] double of_simulation(std::uint32_t simulation) const {
    double sum = 0;
    for (std::uint32_t s = 0; s < p_.size(); ++s) sum += model_.sample(s).simulation == simulation ? p_[s] : 0;
    return sum;
  }
  [[nodiscard]] std::uint32_t likeliest() const {
    return static_cast<std::uint32_t>(std::ranges::max_element(p_) - p_.begin());
  }

 private:
  static constexpr double noise = 0.5;  // mm, the default
  void predict() {
    double reached = 0, newcomers = 0;
    for (std::uint32_t s = 0; s < p_.size(); ++s) reached += p_[s] * model_.sample(s).time_step;
    for (std::uint32_t s = 0; s < p_.size(); ++s) newcomers += model_.sample(s).time_step + 1 >= reached ? 1 : 0;
    const double stay = 1 - double{config_.change}, more = config_.persistence;
    double carried = 0;
    for (std::uint32_t s = 0; s < p_.size(); ++s) {
      const bool is_last = s + 1 == p_.size() || model_.sample(s + 1).simulation != model_.sample(s).simulation;
      carried = more * carried + (1 - more) * p_[s];
      p_[s] = stay * carried + (is_last ? stay * more * carried : 0) +
              (model_.sample(s).time_step + 1 >= reached ? double{config_.change} / newcomers : 0);
      if (is_last) carried = 0;
    }
  }

  const Model& model_;
  TrackerConfig config_;
  std::vector<double> p_;
};

}  // namespace

// Simulations without a candidate share their probabilities; some become candidates late, one never.
TEST_CASE("the probabilities are those of a hidden Markov model over all samples") {
  const AlignedBytes bytes = seen_plates_model(6, 8);
  const Model model = Model::view(bytes.span());
  Tracker tracker(model);
  for (int test = 0; test < 2; ++test, tracker.reset()) {
    PlainTracker plain(model);
    for (std::uint32_t frame = 0; frame < 14; ++frame) {
      std::vector<Match> candidates;
      for (std::uint32_t k = 0; k < 3; ++k)
        candidates.push_back(
            {{(frame / 3 + k * k) % 5, std::min(1 + frame / 2 + k % 2, 7u)}, 1 + 0.2f * static_cast<float>(k)});
      MatchResult result;
      result.fit.candidates = candidates;
      tracker.update(result);
      plain.update(candidates, frame == 0);
      const TestState& state = tracker.state();
      for (std::uint32_t i = 0; i < model.simulations(); ++i)
        CHECK(double{state.simulation_probabilities[i]} == doctest::Approx(plain.of_simulation(i)).epsilon(1e-5));
      CHECK(state.sample == model.sample(plain.likeliest()));
    }
  }
}

TEST_CASE("the path looks back: a later frame decides between candidates with nearly the same rank") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  const TwoFrames frames;
  const auto path = likeliest_path(model, std::vector<std::vector<Match>>{frames.second, {}, frames.first});
  REQUIRE(path.size() == 3);
  CHECK(path[0] == Sample{0, 3});
  CHECK(path[1] == Sample{0, 3});
  CHECK(path[2] == Sample{0, 1});
  CHECK(likeliest_path(model, {}).empty());
  const std::vector<std::vector<Match>> forged{{{{4'000'000'000, 1}, 1.0f}, {{0, 99}, 1.0f}, {{1, 1}, std::nanf("")}},
                                               frames.first};
  CHECK(likeliest_path(model, forged)[1] == Sample{0, 1});
  CHECK(likeliest_path(model, forged)[0] == Sample{0, 1});  // that of the first frame with candidates
  const std::vector<float> ranks{4, 5};
  CHECK(ranked(frames.first, ranks)[1].distance == 5);
  CHECK(ranked(frames.first, {})[1].distance == 3);
}
