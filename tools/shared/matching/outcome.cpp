#include "tools/shared/matching/outcome.hpp"

#include <algorithm>

namespace lbea {

namespace {

constexpr std::size_t published_chances = 8, most_candidates = 64, most_branches = 64;

WireStatus to_wire(Status status) noexcept {
  switch (status) {
    case Status::ok: return WireStatus::ok;
    case Status::low_coverage: return WireStatus::low_coverage;
    case Status::too_many_points: return WireStatus::too_many_points;
    default: return WireStatus::empty_frame;  // the loop has no other status
  }
}

WireVerdict verdict_of(WireStatus status) noexcept {
  if (status == WireStatus::ok) return WireVerdict::matched;
  if (status == WireStatus::low_coverage) return WireVerdict::low_coverage;
  return fate_of(status) == Fate::rejected ? WireVerdict::refused : WireVerdict::unknown;
}

WireVerdict to_wire(Verdict verdict) noexcept {
  switch (verdict) {
    case Verdict::matched: return WireVerdict::matched;
    case Verdict::ambiguous: return WireVerdict::ambiguous;
    case Verdict::no_simulation_fits: return WireVerdict::no_simulation_fits;
    case Verdict::unknown: break;
  }
  return WireVerdict::unknown;
}

// The likeliest simulations, best first, in memory that is there.
void rank(std::span<const float> probabilities, std::vector<SimulationChance>& chances) noexcept {
  chances.clear();
  for (std::uint32_t i = 0; i < probabilities.size(); ++i) {
    const auto place = std::ranges::find_if(chances, [&](const SimulationChance& c) { return c.probability < probabilities[i]; });
    if (chances.size() == published_chances) {
      if (place == chances.end()) continue;
      std::copy_backward(place, chances.end() - 1, chances.end());
      *place = {i, probabilities[i]};
    } else {
      chances.insert(place, {i, probabilities[i]});
    }
  }
}

void fill(WireFit& fit, const SurfaceFit& from) noexcept {
  fit.residual = from.residual;
  fit.estimate_residual = from.estimate_residual;
  fit.misfit = from.misfit;
  fit.spread = from.spread;
  fit.candidates.assign(from.candidates.begin(), from.candidates.end());
  fit.estimate.assign(from.estimate.begin(), from.estimate.end());
}

void fill(WireTestState& test, const TestState& from) noexcept {
  test.frames = from.frames;
  test.simulation = from.simulation;
  test.sample = from.sample;
  test.sample_probability = from.sample_probability;
  test.misfit = from.misfit;
  test.verdict = to_wire(from.verdict);
  rank(from.simulation_probabilities, test.simulations);
  test.branches.assign(from.branch_probabilities.begin(), from.branch_probabilities.end());
}

}  // namespace

void reserve(Outcome& outcome, std::uint32_t max_matches) {
  outcome.matches.reserve(max_matches);
  outcome.fit.candidates.reserve(most_candidates);
  outcome.fit.estimate.reserve(most_candidates);
  outcome.test.simulations.reserve(published_chances);
  outcome.test.branches.reserve(most_branches);
}

void clear(Outcome& outcome) noexcept {
  outcome.result = {};
  outcome.matches.clear();
  outcome.fit.candidates.clear();
  outcome.test.frames = 0;
}

void fill_outcome(Outcome& outcome, const MatchResult& match, const TestState* test) noexcept {
  WireResult& result = outcome.result;
  result.status = to_wire(match.status);
  result.reference = match.reference;
  result.coverage = match.coverage;
  result.points = match.points;
  result.elapsed_ns.match = match.elapsed_ns;
  result.leading_coordinates = match.leading_coordinates;
  result.verdict = to_wire(match.verdict);
  outcome.matches.assign(match.matches.begin(), match.matches.end());
  fill(outcome.fit, match.fit);
  if (test != nullptr) fill(outcome.test, *test);
}

void compose(const Outcome& outcome, const MatchEngine& engine, WireResult& into) {
  into = outcome.result;
  for (const Match& match : outcome.matches)
    into.matches.push_back(
        {match.sample, std::string(engine.simulation_name(match.sample.simulation)), engine.time_s(match.sample), match.distance});
  if (!outcome.fit.candidates.empty()) into.fit = outcome.fit;
  if (outcome.test.frames > 0) into.test = outcome.test;
}

void complete_verdict(WireResult& result) noexcept {
  if (result.verdict == WireVerdict::unknown) result.verdict = verdict_of(result.status);
}

}  // namespace lbea
