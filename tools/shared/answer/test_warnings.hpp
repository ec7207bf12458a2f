// What is wrong with the frames of a test, by their results: low coverage, departed points, wrong capture times, rigs
// that show something else.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <string>

namespace lbea::tool {

/// The coverage of the undeformed component, which shows whether the pose can be right.
class UndeformedCoverage {
 public:
  /// Whether the frame shows the undeformed component: the first matched frame of a session does, and every one whose
  /// best sample is an initial state.
  bool add(const wire::WireResult& result);
  /// Of the latest such frame; of several rigs that are used, the least one.
  [[nodiscard]] std::optional<float> latest() const noexcept { return latest_; }
  /// Which of several rigs has it; empty: all together.
  [[nodiscard]] const std::string& rig() const noexcept { return rig_; }
  /// Too little for a right pose and model.
  [[nodiscard]] bool is_low() const noexcept;

 private:
  std::optional<std::uint64_t> session_;
  std::optional<float> latest_;
  std::string rig_;
};

/// "rig left: " before a sentence about one of several rigs; empty without a name.
[[nodiscard]] std::string rig_prefix(std::string_view rig);

/// A sentence for a low coverage of the undeformed component. rig: of several, or empty.
[[nodiscard]] std::string pose_warning(float coverage, std::string_view rig = {});

/// The division of results into tests: the first matched frame of another session, or after the end of the stream,
/// begins another one.
class TestDivision {
 public:
  /// Of a matched frame: whether it begins a test. Nothing for other results.
  std::optional<bool> begins(const wire::WireResult& result) noexcept;
  /// Whether it belongs to the test that the latest matched frame belongs to.
  [[nodiscard]] bool has(const wire::WireResult& result) const noexcept { return session_ == result.session; }

 private:
  std::optional<std::uint64_t> session_;
};

/// The points near no simulation that the first frame of the test did not have: a part that left the space of the
/// simulations. Of one of several components, at most as many as are near no simulation of any component, and no longer
/// near one of its own.
class DepartedPoints {
 public:
  /// Results of one component. Returns whether the share is that of this frame: of one with a match and, of one of
  /// several components, of one that no longer shows it.
  bool add(const wire::WireResult& result) noexcept;
  /// In the latest such frame, as a share of the points near some simulation in the first one.
  [[nodiscard]] float share() const noexcept { return share_; }
  [[nodiscard]] bool are_many() const noexcept;

 private:
  TestDivision tests_;
  PointTally first_;
  std::uint32_t first_near_none_ = 0;
  float share_ = 0;
};

/// A sentence for many departed points.
[[nodiscard]] std::string departure_warning(float share);

/// How fast the simulations pass, in their time per time of the stamps: the median of the slopes between the first
/// frames of each later state (Theil and Sen).
class SimulatedPace {
 public:
  void begin() noexcept { *this = {}; }
  void add(double simulated_s, std::int64_t stamp_ns) noexcept;
  /// Nothing before eight states.
  [[nodiscard]] std::optional<double> per_second() const noexcept { return per_second_; }

 private:
  [[nodiscard]] double median_slope() const noexcept;

  struct Passage {
    double simulated_s = 0;
    std::int64_t stamp_ns = 0;
  };
  static constexpr std::size_t most = 32, fewest = 8;
  std::array<Passage, most> passages_{};
  std::size_t count_ = 0;
  std::optional<double> per_second_;
};

/// Stamps that cannot be capture times in ns, or not those of one test.
class CaptureTimes {
 public:
  enum class Problem {
    none,
    not_increasing,  // those of most frames increase by less than 1 us, or not at all
    going_back,      // by more than 1 ms
    gap,             // of more than 10 s
    fast,            // the simulations pass much faster than the stamps
    slow,
  };
  void add(const wire::WireResult& result) noexcept;
  [[nodiscard]] Problem problem() const noexcept;

 private:
  [[nodiscard]] Problem problem_of_pace() const noexcept;

  TestDivision tests_;
  bool goes_back_ = false, has_gap_ = false;
  std::uint64_t latest_id_ = 0;
  std::int64_t latest_ns_ = 0;
  std::uint64_t intervals_ = 0, wrong_ = 0;
  SimulatedPace pace_;
};

/// A sentence for wrong capture times.
[[nodiscard]] std::string capture_times_warning(CaptureTimes::Problem problem);

/// Whether simulations explain the frames of several rigs one by one, but not together. Of results of the library or of
/// the wire.
template <class AnyVerdict, class Rigs>
[[nodiscard]] bool are_contradictory(AnyVerdict of_all, const Rigs& rigs) noexcept {
  const auto is_explained = [](const auto& rig) { return rig.is_used && rig.verdict == AnyVerdict::matched; };
  return of_all == AnyVerdict::unknown && std::ranges::count_if(rigs, is_explained) > 1;
}

/// How many captures of a test have frames that simulations explain one by one, but not together.
class Contradictions {
 public:
  void add(bool is_contradiction) noexcept {
    ++captures_;
    contradictions_ += is_contradiction ? 1 : 0;
  }
  /// A quarter of them.
  [[nodiscard]] bool are_many() const noexcept {
    constexpr std::uint32_t fewest = 4;
    return contradictions_ >= fewest && 4 * contradictions_ >= captures_;
  }

 private:
  std::uint32_t captures_ = 0, contradictions_ = 0;
};

/// How many of each rig's frames the results of a test rest on, and whether the rigs contradict each other.
class RigUse {
 public:
  void add(const wire::WireResult& result);
  /// The first rig whose frames with points were mostly not used, of at least eight.
  struct Unused {
    std::string_view rig;
    std::uint32_t frames = 0, used = 0;
  };
  [[nodiscard]] std::optional<Unused> unused() const noexcept;
  [[nodiscard]] bool contradict() const noexcept { return contradictions_.are_many(); }

 private:
  struct Rig {
    std::string name;
    std::uint32_t frames = 0, used = 0;
  };
  TestDivision tests_;
  std::vector<Rig> rigs_;
  Contradictions contradictions_;
};

/// A sentence for a rig whose frames were not used.
[[nodiscard]] std::string unused_rig_warning(const RigUse::Unused& unused);
/// For rigs that contradict each other.
[[nodiscard]] std::string contradiction_warning();

}  // namespace lbea::tool
