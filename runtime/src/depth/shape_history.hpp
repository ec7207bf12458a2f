// The shapes in a test's earlier frames, and what they say about the next one: a component deforms as some simulation
// does, and a hidden part was seen before.
#pragma once

#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/depth/test_clock.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/model/run_samples.hpp"

namespace lbea {

struct EarlierShape {
  static constexpr std::size_t most_similar = 8;

  std::int64_t stamp_ns = 0;
  float error = 0;  // length unit
  std::array<float, ShapeRegression::shape_scores> scores{};
  std::array<std::uint32_t, most_similar> similar{};  // samples nearest to it, nearest first
  std::size_t similar_count = 0;
};

/// Latest first; null: none.
using EarlierShapes = std::array<const EarlierShape*, 3>;

/// Frames in quick succession have the same errors: the estimate of one is no evidence for that of the next. The
/// history therefore gives the shapes that are one, two and three tenths of a simulation's duration older than the
/// frame.
class ShapeHistory {
 public:
  explicit ShapeHistory(double duration_s) noexcept : duration_s_(duration_s) {}
  void reset() noexcept { size_ = 0; }
  void add(const EarlierShape& shape) noexcept;
  /// None that is older than a simulation lasts.
  [[nodiscard]] EarlierShapes before(std::int64_t stamp_ns) const noexcept;

 private:
  static constexpr double least_age = 0.1, least_interval = 0.025;  // durations
  [[nodiscard]] const EarlierShape& latest(std::size_t back) const noexcept {
    return shapes_[(size_ - 1 - back) % shapes_.size()];
  }

  double duration_s_;
  std::array<EarlierShape, 16> shapes_{};  // a ring
  std::size_t size_ = 0;                   // shapes so far
};

/// What is known of a frame before it is compared.
struct FrameExpectation {
  std::int64_t stamp_ns = 0;
  EarlierShapes earlier{};
  TimeBelief time{};      // of similar samples, in theirs
  TimeBelief latest{};    // see TestClock
  bool is_first = false;  // of the test: `latest` counts from the earliest time that the frame may show

  /// Of a first frame. earliest_s: time since the impact that it may show; infinite: not known.
  void begin_at(double earliest_s) noexcept {
    latest = std::isfinite(earliest_s) ? TimeBelief{latest.mean_s + earliest_s, latest.variance} : TimeBelief{};
  }
};

/// The samples that earlier frames propose.
class ContinuedSamples {
 public:
  static constexpr std::size_t most = std::tuple_size_v<EarlierShapes> * EarlierShape::most_similar * 3;

  /// Keeps a reference to the model.
  explicit ContinuedSamples(const ModelView& model) : states_(model) {}
  /// Of the simulations that were similar to the earlier shapes, the state at the time of the frame, or the last one,
  /// and the states before and after it: each once, with the distance 0. Valid until the next call. Does not allocate.
  [[nodiscard]] std::span<const RankedSample> find(const FrameExpectation& expected) noexcept;

 private:
  void add(std::size_t sample) noexcept;

  SimulationStates states_;
  std::array<RankedSample, most> found_{};
  std::size_t count_ = 0;
};

/// How unlikely samples are by what is known before: negative logarithms of probabilities, up to a constant.
class ExpectationCosts {
 public:
  /// Keeps references. Allocates all memory.
  ExpectationCosts(const ModelView& model, const ShapeRegression& regression);
  /// Sets the costs of these samples. Without an expectation all are 0. Does not allocate.
  void assess(std::span<const RankedSample> samples, const FrameExpectation* expected) noexcept;
  /// Of an assessed sample.
  [[nodiscard]] float operator[](std::uint32_t sample) const noexcept { return is_assessed_ ? costs_[sample] : 0; }

 private:
  void add_shape_costs(std::span<const RankedSample> samples, const EarlierShape& earlier, double age_s) noexcept;
  [[nodiscard]] float squared_distance_before(std::uint32_t sample, const EarlierShape& earlier,
                                              double age_s) const noexcept;

  const ModelView& model_;
  const ShapeRegression& regression_;
  SimulationStates states_;
  std::vector<float> costs_;    // per sample
  std::vector<float> squared_;  // per sample: distance from an earlier shape
  bool is_assessed_ = false;
};

}  // namespace lbea
