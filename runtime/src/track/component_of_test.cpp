#include "runtime/src/track/component_of_test.hpp"

#include "runtime/src/numbers/elementary.hpp"
#include "runtime/src/track/same_runs.hpp"

#include <algorithm>

namespace lbea {

void Misfits::add(double weight, double misfit) noexcept {
  ++frames;
  log_misfits += weight * logarithm(misfit);
  weights += weight;
}

void Contradiction::add(double ratio) noexcept {
  ++frames;
  log_ratios += logarithm(ratio);
}

bool Contradiction::is_clear() const noexcept {
  constexpr double clearly_worse = 1.5;  // as for candidates that are clearly different
  return frames > 0 && log_ratios > frames * logarithm(clearly_worse);
}

ComponentOfTest::ComponentOfTest(TrackedComponent component, const Model& first, const TrackerConfig& settings)
    : model(std::move(component.model)),
      views(component.views.empty() ? SensorViews::baked_into(model) : std::move(component.views)),
      config(completed(settings, model)),
      mesh_noise(DepthMetric{}.in(model.length_unit()).mesh_noise),
      misfit_limit(views.test_misfit_limit()),
      to_first(numbers_by_name(model, first)),
      from_first(numbers_by_name(first, model)),
      at_rest(model.samples()),
      usable(model.samples()),
      simulations(model.simulations()),
      branches(model.branches()) {
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    greatest_expected = std::max(greatest_expected, views.expected_residual(s));
}

void ComponentOfTest::reset() noexcept {
  frames_at_rest = 0;
  initial = deformed = {};
  was_used = false;
  contradiction = {};
  state = {};
}

std::span<const Match> ComponentOfTest::keep_usable(std::span<const Match> candidates,
                                                    std::span<const float> distances) noexcept {
  std::size_t count = 0;
  for (std::size_t i = 0; i < candidates.size() && count < usable.size(); ++i) {
    Match& kept = usable[count] = {candidates[i].sample, distances.empty() ? candidates[i].distance : distances[i]};
    if (!is_usable(kept, model)) continue;
    kept.sample.simulation = to_first[kept.sample.simulation];
    ++count;
  }
  return std::span<const Match>(usable).first(count);
}

void ComponentOfTest::take_evidence(const MatchResult& result) noexcept {
  evidence = {};
  if (result.status == Status::ok)
    evidence = keep_usable(result.fit.candidates.empty() ? result.matches : result.fit.candidates, {});
  is_used = !evidence.empty();
  was_used = was_used || is_used;
}

std::span<const Match> ComponentOfTest::ranked(const SurfaceFit& fit) noexcept {
  if (fit.ranks.empty() || fit.ranks.size() != fit.candidates.size()) return {};
  return keep_usable(fit.candidates, fit.ranks);
}

}  // namespace lbea
