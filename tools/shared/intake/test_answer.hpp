// What the results of a test say about the whole test: its verdict, its likeliest simulations, and whether the pose can
// be right.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <optional>

namespace lbea::tool {

/// The coverage of the undeformed component, which shows whether the pose can be right.
class UndeformedCoverage {
 public:
  /// Whether the frame shows the undeformed component: the first matched frame of a session does, and every one whose
  /// best sample is an initial state.
  bool add(const wire::WireResult& result) noexcept;
  /// Of the latest such frame.
  [[nodiscard]] std::optional<float> latest() const noexcept { return latest_; }
  /// Too little for a right pose and model.
  [[nodiscard]] bool is_low() const noexcept;

 private:
  std::optional<std::uint64_t> session_;
  std::optional<float> latest_;
};

/// A sentence for a low coverage of the undeformed component.
[[nodiscard]] std::string pose_warning(float coverage);

/// The division of results into tests: the first matched frame of another session, or after the end of the stream,
/// begins another one.
class TestDivision {
 public:
  /// Of a matched frame: whether it begins a test. Nothing for other results.
  std::optional<bool> begins(const wire::WireResult& result) noexcept;

 private:
  std::optional<std::uint64_t> session_;
};

/// The points near no simulation that the first frame of the test did not have: a part that left the space of the
/// simulations.
class DepartedPoints {
 public:
  void add(const wire::WireResult& result) noexcept;
  /// In the latest matched frame, as a share of the points near some simulation in the first one.
  [[nodiscard]] float share() const noexcept { return share_; }
  [[nodiscard]] bool are_many() const noexcept;

 private:
  TestDivision tests_;
  PointTally first_;
  float share_ = 0;
};

/// A sentence for many departed points.
[[nodiscard]] std::string departure_warning(float share);

/// Stamps that cannot be capture times in ns, because those of most frames increase by less than 1 us, or not at all;
/// or not those of one test, because they go back by more than 1 ms.
class CaptureTimes {
 public:
  void add(const wire::WireResult& result) noexcept;
  [[nodiscard]] bool are_wrong() const noexcept;
  [[nodiscard]] bool go_back() const noexcept { return go_back_; }

 private:
  TestDivision tests_;
  bool go_back_ = false;
  std::uint64_t latest_id_ = 0;
  std::int64_t latest_ns_ = 0;
  std::uint64_t intervals_ = 0, wrong_ = 0;
};

/// A sentence for wrong capture times, or for those that go back.
[[nodiscard]] std::string capture_times_warning(bool go_back);

class TestAnswer {
 public:
  /// Adds a published result; the first frame of another session, or after the end of the stream, begins another test.
  /// Returns whether the frame shows the undeformed component.
  bool add(const wire::WireResult& result);
  /// Of the latest frame that has one. Without frames: method fit did not match, or no frame was informative.
  [[nodiscard]] const wire::WireTestState& state() const noexcept { return state_; }
  [[nodiscard]] std::optional<float> undeformed_coverage() const noexcept { return undeformed_.latest(); }
  /// Empty unless the coverage of the undeformed component is low, or the component, or a part of it, has left the
  /// space that the simulations fill: most frames were rejected, or far more points than in the first frame are near
  /// none; or the capture times are wrong.
  [[nodiscard]] std::string warning() const;
  /// The same for everything that is wrong, most important first.
  [[nodiscard]] std::vector<std::string> warnings() const;
  /// Frames since the test began.
  [[nodiscard]] std::uint64_t matched() const noexcept { return matched_; }
  [[nodiscard]] std::uint64_t rejected() const noexcept { return rejected_; }

 private:
  std::optional<std::uint64_t> session_;
  bool has_ended_ = false;
  std::uint64_t matched_ = 0, rejected_ = 0;  // frames
  UndeformedCoverage undeformed_;
  DepartedPoints departed_;
  CaptureTimes times_;
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
