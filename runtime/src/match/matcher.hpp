// What a Matcher keeps between frames: model, scratch memory of all stages, and their set-up.
#pragma once

#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/fit/test_history.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/correspondence.hpp"
#include "runtime/src/match/position_search.hpp"
#include "runtime/src/match/stopwatch.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea {
/// Method step 2: the reference whose time is nearest to `since_trigger_s`; ties go to the earlier one.
[[nodiscard]] std::uint32_t reference_at(const ModelView& model, double since_trigger_s) noexcept;

/// The configuration with the model's default of `trusted_distance`.
[[nodiscard]] MatcherConfig completed(MatcherConfig config, const Model& model);

/// Throws Error{bad_config} with the offending value.
void check(const MatcherConfig& config, const ModelView& model, const SensorViews& views);

/// Whether the views are those that the model was baked with, or a copy of them.
[[nodiscard]] bool is_baked(const SensorViews& views, const ModelView& model) noexcept;

/// The stages of match(), in their order. Each one adds its part to `result`, with the time that it took.
struct Matcher::State {
  /// most_compared: see SurfaceFitter.
  State(Model m, const MatcherConfig& c, SensorViews views, std::uint32_t most_compared = 0);

  void begin_frame(const Frame& frame, HistoryState* of_test) noexcept;
  /// False, and the status, when the frame is refused.
  bool index_points(const Frame& frame, MatchResult& result) noexcept;
  /// The reference mesh of a frame: method step 2.
  void set_reference(std::int64_t stamp_ns, MatchResult& result) noexcept;
  /// Whether samples are found by the positions of corresponding points, not by depth images.
  [[nodiscard]] bool compares_positions() const noexcept { return !fitter || !fitter->search().proposes(); }
  void correspond(MatchResult& result) noexcept;
  void project(MatchResult& result) noexcept;
  void search(MatchResult& result) noexcept;
  /// estimates_pose: by this frame, if the history does.
  void fit(MatchResult& result, bool estimates_pose = true) noexcept;
  void correct(MatchResult& result) noexcept;
  /// Whether the frame moved the pose, so that it has to be matched again.
  [[nodiscard]] bool move_pose(MatchResult& result) noexcept;
  /// Of the last frame, if the bake has learned how certain such poses are.
  [[nodiscard]] std::optional<PoseMeasurement> pose_by_points() noexcept;
  void remember(MatchResult& result) noexcept;
  void cover(MatchResult& result) noexcept;
  /// Returns the coverage. similar: a sample whose depth image tells what the pose can see of the estimate.
  float cover(std::uint32_t similar) noexcept;
  [[nodiscard]] Status status_of(float coverage) const noexcept {
    return coverage < config.min_coverage ? Status::low_coverage : Status::ok;
  }
  void publish(MatchResult& result) noexcept;
  void publish_coefficients(MatchResult& result) noexcept;
  void publish_matches(std::span<const RankedSample> best_first, MatchResult& result) noexcept;
  void evaluate_channels(MatchResult& result) noexcept;
  void combine_coefficients(std::span<const WeightedSample> estimate) noexcept;

  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept {
    return fitter ? fitter->matches() : best.ranked();
  }

  Model model;
  MatcherConfig config;
  const ModelView& view;
  const ReferenceView* reference = nullptr;  // of the frame
  Stopwatch watch;
  CloudIndex index;
  Positions corresponding;  // e_i, eq. 1
  Positions coefficients;   // e_j, eq. 3
  std::vector<float> public_coefficients;
  BestSamples best;
  std::vector<PositionSearch> position_searches;  // Method::vtp: per reference
  std::vector<SampleTree> trees;                  // per reference; empty when the model has few samples
  std::optional<SurfaceFitter> fitter;
  HistoryState* history = nullptr;  // of the frame's test; null: none
  PoseFilter* pose = nullptr;       // of the history; null: not estimated
  std::vector<Match> matches;
  ChannelEvaluator channels;
  bool has_baked_pose;                     // of the rig
  std::optional<ObservedSurface> surface;  // fit: of the estimate; else: of the best sample
};
}  // namespace lbea
