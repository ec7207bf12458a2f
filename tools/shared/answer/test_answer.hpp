// What the results of a test say about the whole test: its verdict, its likeliest simulations, and whether the pose can
// be right.
#pragma once

#include "tools/shared/answer/test_warnings.hpp"

#include <optional>

namespace lbea::tool {

class TestAnswer {
 public:
  /// Adds a published result; the first frame of another session, or after the end of the stream, begins another test.
  /// Returns whether the frame shows the undeformed component.
  bool add(const wire::WireResult& result);
  /// Of the latest frame that has one. Without frames: method fit did not match, or no frame shows enough.
  [[nodiscard]] const wire::WireTestState& state() const noexcept { return state_; }
  [[nodiscard]] std::optional<float> undeformed_coverage() const noexcept { return undeformed_.latest(); }
  /// Empty unless the coverage of the undeformed component is low, or the component, or a part of it, has left the
  /// space that the simulations fill: most frames were rejected, or far more points than in the first frame are near
  /// none; or the capture times are wrong, a rig's frames are not used, or ids are repeated after the end of a stream.
  [[nodiscard]] std::string warning() const;
  /// The same for everything that is wrong, most important first.
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// Frames since the test began.
  [[nodiscard]] std::uint64_t matched() const noexcept { return matched_; }
  [[nodiscard]] std::uint64_t rejected() const noexcept { return rejected_; }

 private:
  std::optional<std::uint64_t> session_;
  bool has_ended_ = false;
  std::uint64_t matched_ = 0, rejected_ = 0, repeated_ = 0;  // frames; repeated_: after the end of the stream
  UndeformedCoverage undeformed_;
  DepartedPoints departed_;
  CaptureTimes times_;
  RigUse rigs_;
  wire::WireTestState state_;
};

/// Why the whole test is a failure when frames came and none was matched; empty otherwise.
[[nodiscard]] std::string refusal_of_all(const wire::Counters& counters, std::string_view length_unit);

/// How sure: "run_052 (100 %)", "run_052 (55 %) or run_069 (40 %)". When no simulation fits, probabilities mean
/// nothing: "nearest: run_052". `names`: of the simulations.
[[nodiscard]] std::string likely_simulations(const wire::WireTestState& state, std::span<const std::string> names);
/// The rigs that the result of several rests on: "left, right", or "none". Empty for one rig.
[[nodiscard]] std::string used_rigs(const wire::WireResult& result);
/// The same for the end of a line: " by left, right".
[[nodiscard]] std::string by_rigs(const wire::WireResult& result);
/// The verdict, the simulations and the misfit, for a line of text.
[[nodiscard]] std::string answer_text(const wire::WireTestState& state, std::span<const std::string> names);

}  // namespace lbea::tool
