// components.hpp - several components of one test: hood and fender deform in the same run of the same simulation.
//
// Each component has its own model, and each frame is matched with each model. If the ensembles have the same runs, the
// evidence of all components adds up: a run is as likely as all of them say together.
#pragma once

#include <lbea/tracker.hpp>

#include <string>

namespace lbea {

struct TrackedComponent {
  Model model;
  SensorViews views{};  // the matcher's; when empty, those baked into the model
};

/// What keeps two components from being coupled, as the end of a sentence: a run, or a time step or its time, that only
/// one of the models has. Empty: nothing. The order of the runs does not matter.
[[nodiscard]] LBEA_API std::string difference_of_runs(const Model& first, const Model& second);

/// The tracker of one test for several components. With one component it does what Tracker does, to the last bit.
class LBEA_API ComponentTracker {
 public:
  /// `config.noise`: in the length unit of each model. Throws Error{bad_config} with the offending value, without a
  /// component, or if difference_of_runs() finds any.
  explicit ComponentTracker(std::vector<TrackedComponent> components, const TrackerConfig& config = {});
  ~ComponentTracker();
  ComponentTracker(ComponentTracker&&) noexcept;
  ComponentTracker& operator=(ComponentTracker&&) noexcept;

  /// results: one per component, in their order, of the same frame. Those that are refused, have low coverage or no
  /// candidates add no evidence; the sample rests on ranks with low coverage only if there are no others. Does not
  /// allocate, lock or throw.
  void update(std::span<const MatchResult> results) noexcept;
  /// Probabilities and sample are those of all components, numbered as in the model of this one; `frames` counts those
  /// in which any component was evidence; branches, misfit and verdict are the component's own: unknown if none of its
  /// own frames was evidence, ambiguous if its candidates clearly contradict the branch that all components name (other
  /// runs of that branch are no contradiction). Valid until the next update() or reset().
  [[nodiscard]] const TestState& state(std::size_t component) const noexcept;
  [[nodiscard]] std::size_t components() const noexcept;
  /// Starts another test with the next frame.
  void reset() noexcept;

 private:
  struct LBEA_HIDDEN State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea
