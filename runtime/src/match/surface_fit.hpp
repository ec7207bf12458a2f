// Method::fit: LBEA's proposals are compared with the frame as depth images, and a shape between the best of them is
// fitted to it.
#pragma once

#include "runtime/src/match/convex_estimate.hpp"
#include "runtime/src/match/frame_view.hpp"
#include "runtime/src/match/nearest_samples.hpp"
#include "runtime/src/match/view_ranking.hpp"
#include "runtime/src/model/model_view.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

struct FitSettings {
  std::uint32_t proposals = 256;  // samples by eq. 3 whose depth images are compared
  std::uint32_t candidates = 24;  // the best of them, which the estimate combines
  ViewMetric metric;
  // What a share of a sample costs in the estimate, beside the squared residual of the combination:
  float residual_price = 0.2f;  // its own squared residual
  float distance_price =
      0.05f;  // its squared mean distance from the best candidate: a blend of two branches is no shape
  // What a candidate's squared residual weighs in its rank, beside its squared mean distance from the estimate:
  float residual_rank = 0.2f;
  float sharpness = 8;  // plausibility = exp(-sharpness * excess of the squared residual over the best one's)
};

class SurfaceFitter {
 public:
  /// All memory is allocated here.
  SurfaceFitter(const ModelView& model, SensorViews views, std::uint32_t max_matches, const FitSettings& settings = {});

  /// `proposed`: samples worth a look, any order. Needs an index with at least one point. No allocation.
  /// The answer's spans, and matches(), are valid until the next call.
  SurfaceFit fit(const CloudIndex& index, std::span<const RankedSample> proposed) noexcept;
  /// The candidates by nearness to the estimate and own residual, best first; distance: to the estimate.
  [[nodiscard]] std::span<const RankedSample> matches() const noexcept {
    return std::span(matched_).first(matches_.ranked().size());
  }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  [[nodiscard]] const FitSettings& settings() const noexcept { return settings_; }

 private:
  void choose_candidates(std::span<const RankedSample> proposed) noexcept;
  void combine_candidates() noexcept;
  void weigh(SurfaceFit& result) noexcept;
  void rank() noexcept;
  void judge(SurfaceFit& result) noexcept;
  void take_landmarks(std::uint32_t sample, std::span<float> into) const noexcept;
  [[nodiscard]] float mean_distance(std::span<const float> a, std::span<const float> b) const noexcept;
  [[nodiscard]] std::size_t count() const noexcept { return best_.ranked().size(); }
  [[nodiscard]] std::span<float> landmarks(std::size_t candidate) noexcept {
    return std::span(landmarks_).subspan(candidate * landmark_floats_, landmark_floats_);
  }

  const ModelView& model_;
  SensorViews views_;
  FitSettings settings_;
  const Kernels& code_;
  FrameView frame_;
  ViewRanking best_;     // by residual
  BestSamples matches_;  // by nearness to the estimate and own residual; candidates, not samples
  std::vector<RankedSample> matched_;
  std::vector<float> residuals_;  // candidates x cells, depth steps
  std::vector<float> gram_, products_, linear_;
  SimplexProblem simplex_;
  std::vector<std::uint32_t> landmark_nodes_;
  std::size_t landmark_floats_;
  std::vector<float> landmarks_, estimate_landmarks_;  // candidates x 3 x landmarks
  std::vector<float> from_best_, from_estimate_, plausibility_, shares_;
  std::vector<Match> candidates_;
  std::vector<WeightedSample> estimate_;
  float filled_ = 1;  // cells that the frame or the best candidate fills
  Verdict verdict_ = Verdict::unknown;
};

}  // namespace lbea
