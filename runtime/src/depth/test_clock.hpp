// The clock of a test: which time of the simulations a frame shows, by its stamp.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <array>

namespace lbea {

/// Seconds between two stamps, in doubles, so that the difference of any two is defined.
[[nodiscard]] inline double seconds_between(std::int64_t begin_ns, std::int64_t end_ns) noexcept {
  constexpr double seconds_per_nanosecond = 1e-9;
  return (static_cast<double>(end_ns) - static_cast<double>(begin_ns)) * seconds_per_nanosecond;
}

/// Times of an ensemble.
struct EnsembleTimes {
  double impact_s = 0;                    // the first state
  double duration_s = 0, interval_s = 0;  // of a simulation; mean between its states

  /// Time since the impact after which the times of similar samples vary too much to be evidence.
  [[nodiscard]] double late_s() const noexcept { return duration_s / 3; }
  [[nodiscard]] static EnsembleTimes of(const ModelView& model) noexcept;
};

/// Beyond so many durations from the impact, a stamp and the impact are in different units or of different clocks.
inline constexpr double most_durations = 1e4;

struct TimeBelief {
  double mean_s = 0;
  double variance = 0;  // s^2; 0: not known
};

/// Estimates the stamp of the impact from the simulation times of the frames so far. The component may deform faster or
/// slower than the samples that are most similar to it, so that these times are wrong by a share of the time since the
/// impact: a Kalman filter of the impact's stamp and of this share, which early frames determine best.
class TestClock {
 public:
  /// variation: of DepthImages; 0: nothing is estimated.
  TestClock(const EnsembleTimes& times, double variation) noexcept : times_(times), variation_(variation) {}
  /// Forgets the frames, not a known impact.
  void reset() noexcept {
    restart();
    has_started_ = is_known_;
    has_begun_ = false;
  }
  /// The impact's stamp is known; frames do not change it.
  void set_impact(std::int64_t stamp_ns) noexcept;
  /// time: since the impact, of the samples that explain the frame at stamp_ns. Frames that show no deformation are no
  /// evidence, nor those of late times.
  void add(std::int64_t stamp_ns, const TimeBelief& time) noexcept;
  /// Time since the impact at a stamp.
  [[nodiscard]] TimeBelief since_impact(std::int64_t stamp_ns) const noexcept;
  /// The same, of the samples that are similar to a frame at a stamp.
  [[nodiscard]] TimeBelief of_samples(std::int64_t stamp_ns) const noexcept;
  /// The first frame of a test that shows more than a few points, and the time since the impact that it may show at the
  /// earliest; infinite: not known. Later frames change nothing.
  void begin(std::int64_t stamp_ns, double earliest_s) noexcept;
  [[nodiscard]] bool has_begun() const noexcept { return has_begun_; }
  /// Upper bound, with its variance, of the time of the samples that are similar to a frame at a stamp: a test begins
  /// as early as its first frame allows. Before begin(), relative to that time. Without the bound, what hides the part
  /// that deforms first looks like a deformation. Not known once a frame shows a deformation.
  [[nodiscard]] TimeBelief latest(std::int64_t stamp_ns) const noexcept;

 private:
  void start(std::int64_t stamp_ns, const TimeBelief& time) noexcept;
  void restart() noexcept {
    is_started_ = is_known_;
    contradictions_ = 0;
  }
  void update(double since_first, const TimeBelief& time) noexcept;
  /// Of a time that a frame shows, but for the share and the frame's own uncertainty.
  [[nodiscard]] double variance_at(double time_s) const noexcept;

  EnsembleTimes times_;
  double variation_;
  bool is_known_ = false, is_started_ = false;
  bool has_started_ = false;  // in this test, even if contradicted since
  bool has_begun_ = false;
  std::int64_t begin_ns_ = 0;         // stamp of the test's first frame
  double earliest_s_ = 0;             // time since the impact that it may show
  std::int64_t first_ns_ = 0;         // stamp of the first frame that shows a deformation
  double last_ = 0;                   // since then: the last frame that counted
  double impact_ = 0, share_ = 0;     // the impact, since first_ns_; relative error of simulation times
  std::array<double, 3> P_{};         // covariance: impact; both; share
  std::uint32_t contradictions_ = 0;  // in a row
};

}  // namespace lbea
