// What the results of a test say about the whole test: its verdict, its likeliest simulations, and whether the pose can
// be right.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <optional>
#include <span>
#include <string>

namespace lbea::tool {

class TestAnswer {
 public:
  /// Adds a published result; the first one of another session begins another test. Returns whether the frame shows the
  /// undeformed component: the first matched frame does, and every one whose best sample is an initial state.
  bool add(const wire::WireResult& result);
  /// Of the latest frame that has one. Without frames: method fit did not match, or no frame was informative.
  [[nodiscard]] const wire::WireTestState& state() const noexcept { return state_; }
  /// The coverage of the latest frame that shows the undeformed component.
  [[nodiscard]] std::optional<float> undeformed_coverage() const noexcept { return undeformed_coverage_; }
  /// A sentence for an undeformed component that is covered too little for a right pose and model; else empty.
  [[nodiscard]] std::string pose_warning() const;

 private:
  std::optional<std::uint64_t> session_;
  std::optional<float> undeformed_coverage_;
  wire::WireTestState state_;
};

/// How sure: "run_052 (100 %)", "run_052 (55 %) or run_069 (40 %)". When no simulation fits, probabilities mean
/// nothing: "nearest: run_052". `names`: of the simulations.
[[nodiscard]] std::string likely_simulations(const wire::WireTestState& state, std::span<const std::string> names);
/// The verdict, the simulations and the misfit, for a line of text.
[[nodiscard]] std::string answer_text(const wire::WireTestState& state, std::span<const std::string> names);

}  // namespace lbea::tool
