// What a RigMatcher keeps between captures.
#pragma once

#include "runtime/src/fit/joint_fit.hpp"
#include "runtime/src/match/matcher.hpp"

#include <lbea/rigs.hpp>

namespace lbea {

/// Throws Error{bad_config} if a RigMatcher does not take so many.
void require_rig_count(std::size_t rigs);

struct RigMatcher::State {
  State(const Model& model, const MatcherConfig& config, const std::vector<Rig>& rigs);

  void match_alone(std::size_t rig, Frame frame) noexcept;
  [[nodiscard]] MatchResult combine() noexcept;
  void choose_evidence(MatchResult& result) noexcept;
  void begin_capture(MatchResult& result) noexcept;
  void compare_clocks() noexcept;
  [[nodiscard]] std::int64_t correction_ns(std::size_t rig) noexcept;
  void refine_clocks() noexcept;
  void find_latest() noexcept;
  [[nodiscard]] bool is_in_time(std::size_t rig) const noexcept;
  [[nodiscard]] bool awaits_impact(std::size_t rig) const noexcept;
  [[nodiscard]] bool move_poses(bool by_points) noexcept;
  [[nodiscard]] bool move_pose(std::size_t rig, bool by_points) noexcept;
  void cover(MatchResult& result) noexcept;
  void cover(std::size_t rig) noexcept;
  void begin_test(FrameExpectation& first) const noexcept;
  [[nodiscard]] double earliest_s() const noexcept;
  [[nodiscard]] bool is_contradicted() const noexcept;
  /// Forgets the frames since the last capture.
  void begin_capture_anew() noexcept {
    std::ranges::fill(captures, Capture{});
    std::ranges::fill(results, RigResult{});
  }
  [[nodiscard]] bool is_explained(std::size_t rig) const noexcept {
    return is_indexed(rig) && fitter_of(rig).is_explained();
  }
  /// Whether its frame has points on the component.
  [[nodiscard]] bool is_indexed(std::size_t rig) const noexcept { return results[rig].points.used > 0; }
  [[nodiscard]] SurfaceFitter& fitter_of(std::size_t rig) const noexcept { return *matchers[rig]->fitter; }
  void remember(MatchResult& result) noexcept;
  void publish(MatchResult& result) noexcept;

  struct Capture {
    std::uint64_t frame_id = 0;
    std::int64_t stamp_ns = 0;  // by the common clock
    std::span<const Point> points{};
    bool has_frame = false;
    std::size_t place = 0;  // in the evidence
    float shown = 0;        // cells that the frame shows, relative to those that its best sample fills
    StageTimes times{};     // of the frame alone
  };

  std::vector<SensorViews> views;
  std::vector<std::unique_ptr<Matcher::State>> matchers;  // per rig, as the next six
  std::vector<HistoryState> histories;                    // stamps by the rig's own clock
  std::vector<PoseFilter> poses_before;                   // the frame
  std::vector<Capture> captures;
  std::vector<RigResult> results;
  std::vector<std::int64_t> offsets_ns, corrections_ns;
  struct ClockMeasurements {
    double sum_s = 0;  // of corrections
    std::uint32_t count = 0;
  };
  std::vector<ClockMeasurements> measured_clocks;  // since the impact told that they differ
  std::vector<std::uint8_t> poses_by_all;  // whether the frame's pose is estimated by the frames of all rigs alone
  std::vector<RigEvidence> evidence;
  EnsembleTimes times;
  HistoryState joint_history;      // by the common clock; its pose is not used
  std::int64_t latest_ns = 0;      // stamp of the capture's latest frame
  std::size_t used = 0, lead = 0;  // number of rigs that the result rests on; the first of them
  JointFitter fitter;
};

}  // namespace lbea
