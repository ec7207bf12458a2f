#include "runtime/src/track/coupled_test.hpp"

#include "runtime/src/numbers/elementary.hpp"

namespace lbea {
namespace {

std::vector<ComponentOfTest> components_of(std::span<TrackedComponent> tracked, const TrackerConfig& config) {
  const Model first = tracked.front().model;
  std::vector<ComponentOfTest> components;
  components.reserve(tracked.size());
  for (TrackedComponent& component : tracked) components.push_back({std::move(component), first, config});
  return components;
}

std::span<double> of(const ProbabilityBlock& block, std::vector<double>& per_sample) noexcept {
  return std::span(per_sample).subspan(block.first, block.values.size());
}

}  // namespace

CoupledTest::CoupledTest(std::span<TrackedComponent> components, const TrackerConfig& config)
    : components_(components_of(components, config)),
      probabilities_(model()),
      likelihood_(model().samples()),
      sum_(components_.size() > 1 ? model().samples() : 0) {
  publish();
}

void CoupledTest::reset() noexcept {
  for (ComponentOfTest& component : components_) {
    probabilities_.for_each([&](const ProbabilityBlock& block) {
      if (!block.is_shared) std::ranges::fill(of(block, component.at_rest), 0.0);
    });
    component.reset();
  }
  probabilities_.reset();
  later_frames_ = 0;
  publish();
}

void CoupledTest::update(std::span<const MatchResult> results) noexcept {
  results = results.first(std::min(results.size(), components_.size()));
  for (ComponentOfTest& component : components_) component.evidence = {}, component.is_used = false;
  for (std::size_t i = 0; i < results.size(); ++i) components_[i].take_evidence(results[i]);
  const bool has_evidence = std::ranges::any_of(components_, &ComponentOfTest::is_used);
  if (has_evidence) weigh_frame();
  choose(results);
  for (std::size_t i = 0; i < components_.size(); ++i)
    if (components_[i].is_used || (i < results.size() && results[i].status == Status::low_coverage))
      judge(components_[i], results[i].fit);
    else if (has_evidence)
      conclude(components_[i]);  // the other components' evidence may change its branch
}

void CoupledTest::weigh_frame() noexcept {
  const std::uint64_t frames = components_.front().state.frames;
  if (is_at_rest(best())) {
    weigh_at_rest();
  } else {
    if (frames > 0) predict();
    for (const ComponentOfTest& component : components_)
      if (component.is_used) weigh(component);
  }
  for (ComponentOfTest& component : components_) component.state.frames = frames + 1;
  publish();
}

/// The sample that the candidates of all components support most.
Sample CoupledTest::best() noexcept {
  const ComponentOfTest& one = *std::ranges::find_if(components_, &ComponentOfTest::is_used);
  if (std::ranges::count_if(components_, &ComponentOfTest::is_used) == 1) return one.evidence.front().sample;
  sum_.clear();
  for (const ComponentOfTest& c : components_)
    if (c.is_used) sum_.add(model(), c.evidence, {c.evidence.front().distance, c.config}, c.evidence.back().distance);
  return model().sample(sum_.best());
}

// Within a simulation, probability moves forward by a geometrically distributed number of time steps. A share of it
// changes to any simulation, at most one time step before the mean time step reached.
void CoupledTest::predict() noexcept {
  const double stay = 1 - double{config().change}, persistence = double{config().persistence};
  const auto step = [&](const ProbabilityBlock& block, std::size_t i) {
    return model().sample(block.first + static_cast<std::uint32_t>(i)).time_step;
  };
  double reached = 0;  // mean time step
  probabilities_.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i)
      reached += block.simulations * block.values[i] * step(block, i);
  });
  double newcomers = 0;
  probabilities_.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i)
      newcomers += step(block, i) + 1 >= reached ? block.simulations : 0;
  });
  const double change = double{config().change} / std::max(newcomers, 1.0);
  probabilities_.for_each([&](const ProbabilityBlock& block) {
    double carried = 0;
    for (std::size_t i = 0; i < block.values.size(); ++i) {
      carried = persistence * carried + (1 - persistence) * block.values[i];
      block.values[i] = stay * carried + (step(block, i) + 1 >= reached ? change : 0);
    }
    if (!block.values.empty()) block.values.back() += stay * persistence * carried;  // no state follows the last one
  });
}

void CoupledTest::separate(std::span<const Match> evidence) noexcept {
  for (const Match& candidate : evidence) probabilities_.separate(candidate.sample.simulation);
}

// A sample that is no candidate is as likely as the worst candidate: it may rank just below it.
void CoupledTest::weigh(const ComponentOfTest& component) noexcept {
  const std::span<const Match> evidence = component.evidence;
  const Likelihood likelihood_of(evidence.front().distance, component.config);
  const double of_others = likelihood_of(evidence.back().distance);
  separate(evidence);
  probabilities_.for_each([&](const ProbabilityBlock& block) {
    if (!block.is_shared) std::ranges::fill(of(block, likelihood_), of_others);
  });
  for (const Match& candidate : evidence)
    likelihood_[model().sample_index(candidate.sample)] = likelihood_of(candidate.distance);
  probabilities_.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i)
      block.values[i] *= block.is_shared ? of_others : likelihood_[block.first + i];
  });
  probabilities_.normalize();
}

/// Whether a frame precedes the impact: its best sample is an initial state, and at most two of the frames since the
/// last such one looked later.
bool CoupledTest::is_at_rest(Sample best) noexcept {
  constexpr int most_later = 2;
  if (!is_initial(best) || later_frames_ > most_later) {
    ++later_frames_;
    return false;
  }
  later_frames_ = 0;
  return true;
}

void CoupledTest::add_at_rest(ComponentOfTest& component) noexcept {
  const std::span<const Match> evidence = component.evidence;
  const Likelihood likelihood_of(evidence.front().distance, component.config);
  const double of_others = likelihood_of(evidence.back().distance);
  separate(evidence);
  for (const Match& candidate : evidence)
    component.at_rest[model().sample_index(candidate.sample)] +=
        logarithm(likelihood_of(candidate.distance) / of_others);
  ++component.frames_at_rest;
}

// Hundreds of frames before the impact show the same shape with the same errors: they count as one, their geometric
// mean.
void CoupledTest::weigh_at_rest() noexcept {
  for (ComponentOfTest& component : components_)
    if (component.is_used) add_at_rest(component);
  probabilities_.for_each([&](const ProbabilityBlock& block) {
    for (std::size_t i = 0; i < block.values.size(); ++i) {
      double logarithms = 0;
      if (!block.is_shared)
        for (const ComponentOfTest& component : components_)
          logarithms += component.at_rest[block.first + i] / std::max(component.frames_at_rest, 1.0);
      block.values[i] = logarithms == 0 ? 1 : exponential(logarithms);
    }
  });
  probabilities_.normalize();
}

// One test is one run, also where several are equally likely: all components name the same.
void CoupledTest::publish() noexcept {
  std::vector<float>& sums = components_.front().simulations;
  probabilities_.add_up(sums);
  const auto likeliest = static_cast<std::uint32_t>(std::ranges::max_element(sums) - sums.begin());
  for (ComponentOfTest& c : components_) {
    std::ranges::fill(c.branches, 0.0f);
    for (std::uint32_t i = 0; i < c.simulations.size(); ++i) {
      if (&c != &components_.front()) c.simulations[i] = sums[c.to_first[i]];
      c.branches[c.model.branch_of(i)] += c.simulations[i];
    }
    c.state.simulation = c.from_first[likeliest];
    c.state.simulation_probabilities = c.simulations;
    c.state.branch_probabilities = c.branches;
  }
  const auto [sample, probability] = probabilities_.likeliest();
  name(model().sample(sample), probability);
}

void CoupledTest::name(Sample sample, double probability) noexcept {
  for (ComponentOfTest& component : components_) {
    component.state.sample = component.own(sample);
    component.state.sample_probability = static_cast<float>(probability);
  }
}

// Fit has compared the candidates with the earlier frames already: another history made the choice worse. Components
// with low coverage are asked if there is no other.
void CoupledTest::choose(std::span<const MatchResult> results) noexcept {
  for (const Status status : {Status::ok, Status::low_coverage}) {
    const ComponentOfTest* one = nullptr;
    std::size_t count = 0;
    for (std::size_t i = 0; i < results.size(); ++i) {
      ComponentOfTest& component = components_[i];
      component.evidence = {};
      if (results[i].status != status || (status == Status::ok && !component.is_used)) continue;
      component.evidence = component.ranked(results[i].fit);
      if (component.evidence.empty()) continue;
      one = &component;
      ++count;
    }
    if (count == 1) choose_of(*one);
    if (count > 1) choose_of_all();
    if (count > 0) return;
  }
}

void CoupledTest::choose_of(const ComponentOfTest& component) noexcept {
  const Match& best = *std::ranges::min_element(component.evidence, {}, &Match::distance);
  const Plausibility<double> plausibility(best.distance, component.mesh_noise, component.config.sharpness);
  double all = 0;
  for (const Match& m : component.evidence) all += plausibility(m.distance);
  name(best.sample, 1 / all);
}

void CoupledTest::choose_of_all() noexcept {
  sum_.clear();
  for (const ComponentOfTest& c : components_) {
    if (c.evidence.empty()) continue;
    const auto [best, worst] = std::ranges::minmax(c.evidence, {}, &Match::distance);
    TrackerConfig config = c.config;
    config.noise = c.mesh_noise;
    sum_.add(model(), c.evidence, {best.distance, config}, worst.distance);
  }
  const std::uint32_t best = sum_.best();
  name(model().sample(best), sum_.share(best));
}

// Misfits scatter from frame to frame. Over a test their mean distinguishes a run of an unknown branch from one of a
// known branch. Frames of an initial state count as one: hundreds are captured before the impact, and would outvote all
// others.
void CoupledTest::judge(ComponentOfTest& c, const SurfaceFit& fit) noexcept {
  if (!(fit.misfit > 0) || !std::isfinite(fit.misfit) || !(c.misfit_limit > 0) || fit.candidates.empty() ||
      !is_usable(fit.candidates.front(), c.model))
    return;
  const Sample own = fit.candidates.front().sample;
  const double weight =
      misfit_weight(c.views.expected_residual(c.model.sample_index(own)), c.greatest_expected, c.mesh_noise);
  const bool at_rest = is_initial({c.to_first[own.simulation], own.time_step});
  (at_rest ? c.initial : c.deformed).add(weight, double{fit.misfit});
  if (c.is_used && !at_rest && components_.size() > 1) c.contradiction.add(excess_of_named(c, fit));
  const double shared = std::max(c.initial.frames, 1.0);
  const double log_misfits = c.deformed.log_misfits + c.initial.log_misfits / shared,
               weights = c.deformed.weights + c.initial.weights / shared;
  c.state.misfit = static_cast<float>(exponential(log_misfits / weights));
  conclude(c);
}

/// Residual of the best candidate of the branch that all components name, relative to that of the best one. A branch
/// without a candidate is at least as bad as the worst one.
double CoupledTest::excess_of_named(const ComponentOfTest& c, const SurfaceFit& fit) noexcept {
  const std::uint32_t named = c.model.branch_of(c.state.simulation);
  float least = fit.candidates.back().distance;
  for (const Match& candidate : fit.candidates)
    if (is_usable(candidate, c.model) && c.model.branch_of(candidate.sample.simulation) == named)
      least = std::min(least, candidate.distance);
  const auto squared = [&](float distance) { return square<double>(distance) + square<double>(c.mesh_noise); };
  return std::sqrt(squared(least) / squared(fit.candidates.front().distance));
}

/// The evidence of other components alone gives a component no verdict. A branch that its own candidates contradict is
/// not certain.
void CoupledTest::conclude(ComponentOfTest& c) const noexcept {
  if (c.initial.frames + c.deformed.frames < frames_for_verdict) return;
  if (components_.size() > 1 && !c.was_used) return;
  const bool one_branch = *std::ranges::max_element(c.branches) >= certain_branch && !c.contradiction.is_clear();
  c.state.verdict = c.state.misfit > c.misfit_limit ? Verdict::no_simulation_fits
                    : one_branch                    ? Verdict::matched
                                                    : Verdict::ambiguous;
}

}  // namespace lbea
