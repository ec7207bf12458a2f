// Method::fit, first half: the samples whose depth images are most similar to a frame's, and what something hides of
// the frame.
#pragma once

#include "runtime/src/depth/depth_ranking.hpp"
#include "runtime/src/depth/thinned_images.hpp"

#include <lbea/lbea.hpp>

namespace lbea {

/// The depth image of a frame, and what is known about it.
struct FrameImage {
  std::span<float> observed;           // padded_cells() depths in steps
  bool is_hidden = false;              // something hides a part of the component
  std::span<const float> predicted{};  // shape scores by the regression; none: the candidates alone determine the shape
  // To estimate the pose:
  const PoseBelief* prior = nullptr;
  std::span<const float> points{};  // cells() numbers of points
  bool knows_hidden = false;        // only cells that are not_observed may be hidden
  bool is_sparse = false;           // FrameDepthImage::is_sparse()
};

/// What the earlier frames of the test say about a frame.
struct FramePrior {
  const PoseBelief* pose = nullptr;               // null: the pose is known
  const FrameExpectation* expectation = nullptr;  // null: nothing
  const HiddenCells* hidden = nullptr;            // null: none
};

class CandidateSearch {
 public:
  /// Keeps a reference to `images`. Allocates all memory.
  CandidateSearch(const ModelView& model, const DepthImages& images, std::uint32_t max_matches,
                  const FitSettings& settings);

  /// Sets the depth image of a frame. The index must hold at least one point. Does not allocate.
  void build_image(const CloudIndex& index) noexcept;
  /// Whether search() needs no proposals.
  [[nodiscard]] bool proposes() const noexcept { return !thinned_.empty(); }
  /// Compares it with samples. proposed: by eq. 3, in any order; valid as long as the result is used. Does not
  /// allocate.
  void search(std::span<const RankedSample> proposed, const FramePrior& prior) noexcept;
  /// The same for another image, by the proposed samples alone. Hidden cells become not_observed. An image of which
  /// something hides a part must be limited to its Surroundings.
  void search(const FrameImage& image, std::span<const RankedSample> proposed) noexcept;

  /// What the candidates were compared with, and the samples that they were chosen from.
  [[nodiscard]] const FrameImage& image() const noexcept { return image_; }
  [[nodiscard]] std::span<const RankedSample> proposed() const noexcept { return proposed_; }

  /// Most similar first. distance: their residual, and what the history of the test counts against them. Where
  /// something hides a part, the residuals of all but the best include their depth costs.
  [[nodiscard]] std::span<const Match> candidates() const noexcept { return std::span(candidates_).first(count()); }
  [[nodiscard]] std::size_t count() const noexcept { return ranking_.ranked().size(); }
  [[nodiscard]] std::size_t capacity() const noexcept { return ranking_.capacity(); }
  /// Of the model.
  [[nodiscard]] std::uint32_t sample(std::size_t candidate) const noexcept {
    return ranking_.ranked()[candidate].sample;
  }
  [[nodiscard]] std::span<const std::uint16_t> image_of(std::size_t candidate) const noexcept {
    return images_.of_sample(sample(candidate));
  }
  /// Per candidate, length unit: without what the history counts.
  [[nodiscard]] std::span<const float> residuals_alone() const noexcept {
    return std::span(residual_alone_).first(count());
  }
  [[nodiscard]] std::size_t best_alone() const noexcept {
    return static_cast<std::size_t>(std::ranges::min_element(residuals_alone()) - residuals_alone().begin());
  }
  [[nodiscard]] DepthRanking& ranking() noexcept { return ranking_; }
  [[nodiscard]] const DepthRanking& ranking() const noexcept { return ranking_; }

  /// Whether what was copied when this was made may be read: the bake exchanges images and shapes.
  [[nodiscard]] bool reads_copies() const noexcept { return reads_copies_; }
  /// Time since the impact of the earliest sample that explains what the frame shows; infinite: not known, late, or the
  /// frame is not the first of a test.
  [[nodiscard]] double earliest_s() const noexcept { return earliest_s_; }
  /// Adds what something may hide of the frame. Removes what the frame shows.
  void update(HiddenCells& hidden) noexcept;

 private:
  float rank(std::span<float> observed) noexcept;
  void rank_image() noexcept;
  void assess(std::span<const RankedSample> proposed, const FrameExpectation* expected) noexcept;
  [[nodiscard]] std::span<const RankedSample> propose_hidden(const FrameExpectation& expected) noexcept;
  void set_candidates(float not_residual) noexcept;
  [[nodiscard]] float least_residual(std::span<const float> observed,
                                     std::span<const RankedSample> samples) const noexcept;
  [[nodiscard]] float most_explained(float limited) const noexcept;
  [[nodiscard]] double earliest_explaining(float most) noexcept;
  [[nodiscard]] bool is_explained_whole(const FrameExpectation* expected, float most) noexcept;
  [[nodiscard]] bool is_explained_with(const HiddenCells& hidden, float most) noexcept;
  [[nodiscard]] float price(std::uint32_t sample) const noexcept { return ranking_.price_per_cost() * costs_[sample]; }

  const ModelView& model_;
  const DepthImages& images_;
  FitSettings settings_;
  const Kernels& code_;
  EnsembleTimes times_;
  FrameDepthImage frame_;
  Surroundings surroundings_;
  std::vector<float> limited_;  // the frame's cells without the evidence of what it does not show
  std::vector<float> known_;    // the frame's cells without those that something hid in earlier frames
  ThinnedImages thinned_;
  SelectedSamples by_thinned_;
  BestSamples few_;  // of all samples; thinned images are nearly as good as whole ones
  ContinuedSamples continued_;
  std::vector<RankedSample> by_both_;        // by the image and by earlier frames
  std::vector<std::uint32_t> filled_cells_;  // per sample
  ExpectationCosts costs_;
  DepthRanking ranking_;  // by residual
  FrameImage image_{};
  std::span<const RankedSample> proposed_;
  std::vector<Match> candidates_;
  std::vector<float> residual_alone_;
  bool reads_copies_ = false;
  double earliest_s_ = std::numeric_limits<double>::infinity();
};

}  // namespace lbea
