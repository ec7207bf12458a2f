// What a frame's depth image says about candidates: their residuals, cell by cell, and the shape that the regression
// predicts.
#pragma once

#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/fit/candidate_search.hpp"
#include "runtime/src/model/run_samples.hpp"

namespace lbea {

class ImageResiduals {
 public:
  /// search: of the frame. Keeps references. Allocates all memory, for up to `most` candidates.
  ImageResiduals(const DepthImages& images, CandidateSearch& search, std::size_t most);

  /// Sets the residuals of these samples, best first. Does not allocate.
  void compare(std::span<const RankedSample> samples) noexcept;
  /// The same between two states: the residual of a combination is approximated by the combination of the residuals.
  /// prices_hidden: what something may hide of a sample has its price; else no residual, because another image shows
  /// it.
  void compare(std::span<const StateBetween> states, bool prices_hidden) noexcept;
  /// Adds `scale` times their products, k x k, in squared depth steps. Does not allocate.
  void add_products(float scale, std::span<float> gram) noexcept;

  /// Number of cells that the frame or the best candidate fills.
  [[nodiscard]] float filled() const noexcept { return filled_; }
  /// k x padded_cells(): sample minus frame, depth steps.
  [[nodiscard]] std::span<const float> all() const noexcept { return residuals_; }

  /// Shape scores that the regression predicts of an image of which nothing is hidden; see ShapePredictor.
  [[nodiscard]] std::span<const float> predict(std::span<const float> observed) noexcept {
    return predictor_.predict(observed);
  }
  /// The same where something hides a part, of the frame completed by the combination of the candidates. Without a
  /// regression for such frames, nothing.
  [[nodiscard]] std::span<const float> predict_completed(std::span<const float> shares) noexcept;
  /// Completes the frame by the combination of the candidates.
  void complete(std::span<const float> shares) noexcept;
  /// The last frame that was completed, padded_cells() depths in steps.
  [[nodiscard]] std::span<const float> completed() const noexcept { return completed_.cells(); }
  [[nodiscard]] const ShapeRegression& regression() const noexcept { return images_.regression; }

 private:
  void compare_states() noexcept;
  [[nodiscard]] float subtract(std::uint32_t sample, std::span<float> residuals) noexcept;
  void gather() noexcept;
  [[nodiscard]] std::span<float> of(std::size_t candidate) noexcept {
    const std::size_t cells = padded_cells(images_.camera);
    return std::span(residuals_).subspan(candidate * cells, cells);
  }

  const DepthImages& images_;
  CandidateSearch& search_;
  const Kernels& code_;
  std::vector<StateBetween> states_;
  std::size_t count_ = 0;
  bool prices_hidden_ = true;
  std::vector<float> residuals_;      // candidates x cells, depth steps
  std::vector<float> of_next_;        // cells: of a candidate's second state
  std::vector<float> gathered_;       // residuals_ where any of them is not zero
  std::vector<std::uint32_t> lines_;  // first cells of these lines
  std::vector<float> products_;
  float filled_ = 1;
  ShapePredictor predictor_;
  CompletedImage completed_;
};

}  // namespace lbea
