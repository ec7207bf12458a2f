#include "runtime/src/track/tracker.hpp"

#include "runtime/src/numbers/elementary.hpp"
#include "runtime/src/track/sample_probabilities.hpp"

namespace lbea {
namespace {

void require(bool holds, const char* name, float value, const char* range) {
  if (!holds)
    throw Error(Status::bad_config,
                std::string("tracker configuration: ") + name + " is " + std::to_string(value) + "; give " + range);
}

void check(const TrackerConfig& config) {
  require(config.sharpness > 0 && std::isfinite(config.sharpness), "sharpness", config.sharpness, "a positive number");
  require(config.noise >= 0 && std::isfinite(config.noise), "noise", config.noise, "a length, or 0 for the default");
  require(config.persistence >= 0 && config.persistence < 1, "persistence", config.persistence,
          "a share from 0 to below 1");
  require(config.change >= 0 && config.change <= 1, "change", config.change, "a share from 0 to 1");
}

}  // namespace

struct Tracker::State {
  State(Model m, const TrackerConfig& c, SensorViews v)
      : model(std::move(m)),
        views(std::move(v)),
        config(completed(c, model)),
        mesh_noise(DepthMetric{}.in(model.length_unit()).mesh_noise),
        misfit_limit(views.test_misfit_limit()),
        probabilities(model),
        likelihood(model.samples()),
        at_rest(model.samples()),
        usable(model.samples()),
        simulations(model.simulations()),
        branches(model.branches()) {
    publish();
  }

  void reset() noexcept;
  std::span<const Match> keep_usable(std::span<const Match> candidates, std::span<const float> distances) noexcept;
  [[nodiscard]] bool is_initial(Sample sample) const noexcept {
    return model.sample_index(sample) == probabilities.first(sample.simulation);
  }
  [[nodiscard]] bool is_at_rest(Sample best) noexcept;
  [[nodiscard]] static std::span<double> of(const ProbabilityBlock& block, std::vector<double>& per_sample) noexcept {
    return std::span(per_sample).subspan(block.first, block.values.size());
  }
  void predict() noexcept;
  void weigh(std::span<const Match> evidence) noexcept;
  void weigh_at_rest(std::span<const Match> evidence) noexcept;
  void separate(std::span<const Match> evidence) noexcept;
  void publish() noexcept;
  void choose(const SurfaceFit& fit) noexcept;
  void judge(const SurfaceFit& fit) noexcept;

  /// Sums over frames.
  struct Misfits {
    double frames = 0, log_misfits = 0, weights = 0;

    void add(double weight, double misfit) noexcept {
      ++frames;
      log_misfits += weight * logarithm(misfit);
      weights += weight;
    }
  };

  Model model;
  SensorViews views;
  TrackerConfig config;
  float mesh_noise;
  float misfit_limit;         // 0: no depth images, so no verdict
  Misfits initial, deformed;  // of frames that match an initial state, and of the others
  SampleProbabilities probabilities;
  // Per sample, of simulations with their own probabilities; the latter: sum of logarithms over the frames before the
  // impact.
  std::vector<double> likelihood, at_rest;
  double frames_at_rest = 0;
  int later_frames = 0;       // since the last one at rest
  std::vector<Match> usable;  // of a frame
  std::vector<float> simulations, branches;
  TestState state;
};

void Tracker::State::reset() noexcept {
  probabilities.for_each([&](const ProbabilityBlock& block) {
    if (!block.is_shared) std::ranges::fill(of(block, at_rest), 0.0);
  });
  probabilities.reset();
  frames_at_rest = later_frames = 0;
  state = {};
  initial = deformed = {};
  publish();
}

// Within a simulation, probability moves forward by a geometrically distributed number of time steps. A share of it
// changes to any simulation, at most one time step before the mean time step reached.
void Tracker::State::predict() noexcept {
  const double stay = 1 - double{config.change}, persistence = double{config.persistence};
  const auto step = [&](const ProbabilityBlock& block, std::size_t i) {
    return model.sample(block.first + static_cast<std::uint32_t>(i)).time_step;
  };
  double reached = 0;  // mean time step
  probabilities.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i)
      reached += block.simulations * block.values[i] * step(block, i);
  });
  double newcomers = 0;
  probabilities.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i)
      newcomers += step(block, i) + 1 >= reached ? block.simulations : 0;
  });
  const double change = double{config.change} / std::max(newcomers, 1.0);
  probabilities.for_each([&](const ProbabilityBlock& block) {
    double carried = 0;
    for (std::size_t i = 0; i < block.values.size(); ++i) {
      carried = persistence * carried + (1 - persistence) * block.values[i];
      block.values[i] = stay * carried + (step(block, i) + 1 >= reached ? change : 0);
    }
    if (!block.values.empty()) block.values.back() += stay * persistence * carried;  // no state follows the last one
  });
}

void Tracker::State::separate(std::span<const Match> evidence) noexcept {
  for (const Match& candidate : evidence) probabilities.separate(candidate.sample.simulation);
}

// A sample that is no candidate is as likely as the worst candidate: it may rank just below it.
void Tracker::State::weigh(std::span<const Match> evidence) noexcept {
  const Likelihood likelihood_of(evidence.front().distance, config);
  const double of_others = likelihood_of(evidence.back().distance);
  separate(evidence);
  probabilities.for_each([&](const ProbabilityBlock& block) {
    if (!block.is_shared) std::ranges::fill(of(block, likelihood), of_others);
  });
  for (const Match& candidate : evidence)
    likelihood[model.sample_index(candidate.sample)] = likelihood_of(candidate.distance);
  probabilities.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i)
      block.values[i] *= block.is_shared ? of_others : likelihood[block.first + i];
  });
  probabilities.normalize();
}

/// Whether a frame precedes the impact: its best sample is an initial state, and at most two of the frames since the
/// last such one looked later.
bool Tracker::State::is_at_rest(Sample best) noexcept {
  constexpr int most_later = 2;
  if (!is_initial(best) || later_frames > most_later) {
    ++later_frames;
    return false;
  }
  later_frames = 0;
  return true;
}

// Hundreds of frames before the impact show the same shape with the same errors: they count as one, their geometric
// mean.
void Tracker::State::weigh_at_rest(std::span<const Match> evidence) noexcept {
  const Likelihood likelihood_of(evidence.front().distance, config);
  const double of_others = likelihood_of(evidence.back().distance);
  separate(evidence);
  for (const Match& candidate : evidence)
    at_rest[model.sample_index(candidate.sample)] += logarithm(likelihood_of(candidate.distance) / of_others);
  ++frames_at_rest;
  probabilities.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i) {
      const double logarithms = block.is_shared ? 0 : at_rest[block.first + i];
      block.values[i] = logarithms == 0 ? 1 : exponential(logarithms / frames_at_rest);
    }
  });
  probabilities.normalize();
}

void Tracker::State::publish() noexcept {
  probabilities.add_up(simulations);
  std::ranges::fill(branches, 0.0f);
  for (std::uint32_t i = 0; i < model.simulations(); ++i) branches[model.branch_of(i)] += simulations[i];
  const auto [sample, probability] = probabilities.likeliest();
  state.sample = model.sample(sample);
  state.sample_probability = static_cast<float>(probability);
  state.simulation = static_cast<std::uint32_t>(std::ranges::max_element(simulations) - simulations.begin());
  state.simulation_probabilities = simulations;
  state.branch_probabilities = branches;
}

/// The usable candidates, with the distances instead of their own unless there are none.
std::span<const Match> Tracker::State::keep_usable(std::span<const Match> candidates,
                                                   std::span<const float> distances) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < candidates.size() && count < usable.size(); ++i) {
    usable[count] = {candidates[i].sample, distances.empty() ? candidates[i].distance : distances[i]};
    if (is_usable(usable[count], model)) ++count;
  }
  return std::span<const Match>(usable).first(count);
}

// Fit has compared the candidates with the earlier frames already: another history made the choice worse.
void Tracker::State::choose(const SurfaceFit& fit) noexcept {
  if (fit.ranks.empty() || fit.ranks.size() != fit.candidates.size()) return;
  const auto candidates = keep_usable(fit.candidates, fit.ranks);
  if (candidates.empty()) return;
  const Match& best = *std::ranges::min_element(candidates, {}, &Match::distance);
  const Plausibility<double> plausibility(best.distance, mesh_noise, config.sharpness);
  double all = 0;
  for (const Match& m : candidates) all += plausibility(m.distance);
  state.sample = best.sample;
  state.sample_probability = static_cast<float>(1 / all);
}

// Misfits scatter from frame to frame. Over a test their mean distinguishes a run of an unknown branch from one of a
// known branch. The weight of a frame is one over the square of its expected residual. Frames of an initial
// state count as one: hundreds are captured before the impact, and would outvote all others.
void Tracker::State::judge(const SurfaceFit& fit) noexcept {
  if (!(fit.misfit > 0) || !std::isfinite(fit.misfit) || !(misfit_limit > 0) || fit.candidates.empty() ||
      !is_usable(fit.candidates.front(), model))
    return;
  const Sample best = fit.candidates.front().sample;
  const std::uint32_t sample = model.sample_index(best);
  const double weight = 1 / (square<double>(views.expected_residual(sample)) + square<double>(mesh_noise));
  (is_initial(best) ? initial : deformed).add(weight, double{fit.misfit});
  const double shared = std::max(initial.frames, 1.0);
  const double log_misfits = deformed.log_misfits + initial.log_misfits / shared,
               weights = deformed.weights + initial.weights / shared;
  state.misfit = static_cast<float>(exponential(log_misfits / weights));
  if (initial.frames + deformed.frames < frames_for_verdict) return;
  const bool one_branch = *std::ranges::max_element(branches) >= certain_branch;
  state.verdict = state.misfit > misfit_limit ? Verdict::no_simulation_fits
                  : one_branch                ? Verdict::matched
                                              : Verdict::ambiguous;
}

Tracker::Tracker(Model model, const TrackerConfig& config, SensorViews views) {
  check(config);
  if (views.empty()) views = SensorViews::baked_into(model);
  state_ = std::make_unique<State>(std::move(model), config, std::move(views));
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
const TestState& Tracker::state() const noexcept { return state_->state; }
void Tracker::reset() noexcept { state_->reset(); }

const TestState& Tracker::update(const MatchResult& result) noexcept {
  const auto evidence = state_->keep_usable(result.fit.candidates.empty() ? result.matches : result.fit.candidates, {});
  if (result.status == Status::low_coverage) {  // too little to tell simulations apart
    state_->choose(result.fit);
    state_->judge(result.fit);
  }
  if (result.status != Status::ok || evidence.empty()) return state_->state;
  if (state_->is_at_rest(evidence.front().sample)) {
    state_->weigh_at_rest(evidence);
  } else {
    if (state_->state.frames > 0) state_->predict();
    state_->weigh(evidence);
  }
  ++state_->state.frames;
  state_->publish();
  state_->choose(result.fit);
  state_->judge(result.fit);
  return state_->state;
}

}  // namespace lbea
