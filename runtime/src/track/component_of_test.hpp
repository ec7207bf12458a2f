// What the tracker of a test knows of one component.
#pragma once

#include "runtime/src/track/tracker.hpp"

#include <lbea/components.hpp>

namespace lbea {

/// Sums over frames.
struct Misfits {
  double frames = 0, log_misfits = 0, weights = 0;

  void add(double weight, double misfit) noexcept;
};

/// By how much its own candidates explain the frames better than those of the branch that all components name: mean
/// logarithm of the ratio of the residuals.
struct Contradiction {
  double frames = 0, log_ratios = 0;

  void add(double ratio) noexcept;
  [[nodiscard]] bool is_clear() const noexcept;
};

/// Samples are numbered as in the model of the first component, unless they are called own.
struct ComponentOfTest {
  /// Allocates all memory. `first`: the model of the first component, with the same runs.
  ComponentOfTest(TrackedComponent component, const Model& first, const TrackerConfig& settings);
  void reset() noexcept;

  /// The usable candidates, with the distances instead of their own unless there are none; valid until the next call.
  [[nodiscard]] std::span<const Match> keep_usable(std::span<const Match> candidates,
                                                   std::span<const float> distances) noexcept;
  /// The candidates of a result, if it is trusted.
  void take_evidence(const MatchResult& result) noexcept;
  /// The candidates with their ranks; none without ranks.
  [[nodiscard]] std::span<const Match> ranked(const SurfaceFit& fit) noexcept;
  [[nodiscard]] Sample own(Sample sample) const noexcept { return {from_first[sample.simulation], sample.time_step}; }

  Model model;
  SensorViews views;
  TrackerConfig config;
  float mesh_noise;
  float misfit_limit;                               // 0: no depth images, so no verdict
  float greatest_expected = 0;                      // expected residual of all samples, length unit
  std::vector<std::uint32_t> to_first, from_first;  // numbers of simulations
  std::vector<double> at_rest;                      // per sample: sum of logarithms over the frames before the impact
  double frames_at_rest = 0;
  std::vector<Match> usable;                 // of a frame
  std::span<const Match> evidence;           // those of usable that count
  bool is_used = false;                      // they were evidence
  bool was_used = false;                     // in any frame
  Contradiction contradiction;               // of deformed frames
  Misfits initial, deformed;                 // of frames that match an initial state, and of the others
  std::vector<float> simulations, branches;  // probabilities, own numbers
  TestState state;                           // own numbers
};

}  // namespace lbea
