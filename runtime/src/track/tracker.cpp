#include "runtime/src/model/view_data.hpp"
#include "runtime/src/track/evidence.hpp"

#include <lbea/tracker.hpp>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

namespace lbea {
namespace {

void require(bool holds, const char* name, float value, const char* range) {
  if (!holds)
    throw Error(Status::bad_config,
                std::string("tracker configuration: ") + name + " is " + std::to_string(value) + "; give " + range);
}

void check(const TrackerConfig& config) {
  require(config.sharpness > 0 && std::isfinite(config.sharpness), "sharpness", config.sharpness, "a positive number");
  require(config.noise > 0 && std::isfinite(config.noise), "noise", config.noise, "a positive length");
  require(config.persistence >= 0 && config.persistence < 1, "persistence", config.persistence,
          "a share from 0 to below 1");
  require(config.change >= 0 && config.change <= 1, "change", config.change, "a share from 0 to 1");
}

}  // namespace

struct Tracker::State {
  State(Model m, const TrackerConfig& c, const SensorViews& views)
      : model(std::move(m)),
        config(c),
        misfit_limit(views.test_misfit_limit()),
        probability(model.samples()),
        likelihood(model.samples()),
        first(model.simulations() + 1),
        simulations(model.simulations()),
        branches(model.branches()) {
    for (std::uint32_t s = 0; s < model.samples(); ++s) ++first[model.sample(s).simulation + 1];
    for (std::size_t i = 1; i < first.size(); ++i) first[i] += first[i - 1];
    reset();
  }

  void reset() noexcept;
  void predict() noexcept;
  void weigh(std::span<const Match> evidence) noexcept;
  void publish() noexcept;
  void judge(const SurfaceFit& fit) noexcept;

  Model model;
  TrackerConfig config;
  float misfit_limit;  // 0: no views, no verdict
  double log_misfits = 0, weights = 0;
  std::uint64_t judged = 0;                     // frames
  std::vector<double> probability, likelihood;  // per sample
  std::vector<std::uint32_t> first;             // per simulation: its first sample
  std::vector<float> simulations, branches;
  TestState state;
};

void Tracker::State::reset() noexcept {
  std::ranges::fill(probability, 1.0 / static_cast<double>(probability.size()));
  state = {};
  log_misfits = weights = 0;
  judged = 0;
  publish();
}

// Forward in time: a geometric number of steps within each simulation; a share starts anew in any simulation, no
// earlier than the time step it has reached.
void Tracker::State::predict() noexcept {
  const double stay = 1 - double{config.change};
  double reached = 0;  // mean time step, by which those that change are placed
  for (std::uint32_t s = 0; s < model.samples(); ++s) reached += probability[s] * model.sample(s).time_step;
  double newcomers = 0;
  for (std::uint32_t s = 0; s < model.samples(); ++s) newcomers += model.sample(s).time_step + 1 >= reached ? 1 : 0;
  for (std::size_t simulation = 0; simulation + 1 < first.size(); ++simulation) {
    double carried = 0;
    for (std::uint32_t s = first[simulation]; s < first[simulation + 1]; ++s) {
      carried = double{config.persistence} * carried + (1 - double{config.persistence}) * probability[s];
      const bool newcomer = model.sample(s).time_step + 1 >= reached;
      probability[s] = stay * carried + (newcomer ? double{config.change} / std::max(newcomers, 1.0) : 0);
    }
    if (first[simulation] < first[simulation + 1])
      probability[first[simulation + 1] - 1] += stay * double{config.persistence} * carried;  // the end holds
  }
}

// Samples that are no candidates are as likely as the worst of those that are: they may be just behind it.
void Tracker::State::weigh(std::span<const Match> evidence) noexcept {
  const Plausibility plausibility(evidence.front().distance, config);
  std::ranges::fill(likelihood, plausibility(evidence.back().distance));
  for (const Match& candidate : evidence)
    likelihood[model.sample_index(candidate.sample)] = plausibility(candidate.distance);
  double all = 0;
  for (std::size_t s = 0; s < probability.size(); ++s) all += probability[s] *= likelihood[s];
  for (double& p : probability) p /= all;
}

void Tracker::State::publish() noexcept {
  std::ranges::fill(simulations, 0.0f);
  std::ranges::fill(branches, 0.0f);
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    simulations[model.sample(s).simulation] += static_cast<float>(probability[s]);
  for (std::uint32_t i = 0; i < model.simulations(); ++i) branches[model.branch_of(i)] += simulations[i];
  const auto likeliest = static_cast<std::uint32_t>(std::ranges::max_element(probability) - probability.begin());
  state.sample = model.sample(likeliest);
  state.sample_probability = static_cast<float>(probability[likeliest]);
  state.simulation = static_cast<std::uint32_t>(std::ranges::max_element(simulations) - simulations.begin());
  state.simulation_probabilities = simulations;
  state.branch_probabilities = branches;
}

// Misfits scatter from frame to frame; over a test their mean tells an unknown branch from an unseen run. Frames in
// which unseen runs leave little count for more: a frame's weight is one over the square of the residual expected of
// it.
void Tracker::State::judge(const SurfaceFit& fit) noexcept {
  if (!(fit.misfit > 0) || !(misfit_limit > 0)) return;
  constexpr std::uint64_t least_frames = 4;
  constexpr float sure = 0.9f;
  const double noise = double{ViewMetric{}.mesh_noise}, residual = double{fit.residual}, misfit = double{fit.misfit};
  const double weight = misfit * misfit / (residual * residual + noise * noise);
  log_misfits += weight * std::log(misfit);
  weights += weight;
  state.misfit = static_cast<float>(std::exp(log_misfits / weights));
  if (++judged < least_frames) return;
  const bool one_branch = *std::ranges::max_element(branches) >= sure;
  state.verdict = state.misfit > misfit_limit ? Verdict::no_simulation_fits
                  : one_branch                ? Verdict::matched
                                              : Verdict::ambiguous;
}

Tracker::Tracker(Model model, const TrackerConfig& config, SensorViews views) {
  check(config);
  if (views.empty()) views = SensorViews::baked_into(model);
  state_ = std::make_unique<State>(std::move(model), config, views);
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;
const TestState& Tracker::state() const noexcept { return state_->state; }
void Tracker::reset() noexcept { state_->reset(); }

const TestState& Tracker::update(const MatchResult& result) noexcept {
  const auto evidence = result.fit.candidates.empty() ? result.matches : result.fit.candidates;
  if (result.status == Status::low_coverage) state_->judge(result.fit);  // too little to name a sample, enough to doubt
  if (result.status != Status::ok || evidence.empty()) return state_->state;
  if (state_->state.frames++ > 0) state_->predict();
  state_->weigh(evidence);
  state_->publish();
  state_->judge(result.fit);
  return state_->state;
}

}  // namespace lbea
