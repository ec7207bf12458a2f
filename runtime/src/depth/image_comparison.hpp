// The comparison of a frame's depth image with those of samples: residuals, squares, the best of all samples.
#pragma once

#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/match/sample_search.hpp"
#include "runtime/src/numbers/elementary.hpp"

namespace lbea {

/// The metric's costs in depth steps.
[[nodiscard]] CellPrices prices_of(const DepthMetric& metric, const DepthCamera& camera) noexcept;
/// Of the differences between a frame and a sample (as many cells), over the cells that either fills, in squared depth
/// steps.
[[nodiscard]] float mean_square(const Kernels& code, std::span<const float> observed, const std::uint16_t* sample,
                                const CellPrices& prices) noexcept;

/// Compares images in whole depth steps, by lines of cells.
class LineComparison {
 public:
  /// Allocates all memory, for images of `cells` cells (padded).
  LineComparison(std::size_t cells, const CellPrices& prices);
  /// observed: as many depths in steps as the images have cells; not_observed ones count as empty, and what samples
  /// fill of them is counted. Does not allocate.
  void set_frame(std::span<const float> observed) noexcept;
  /// The same without the lines that the frame does not fill; all that samples fill is counted.
  void set_filled_lines(std::span<const float> observed) noexcept;
  /// Squares in squared depth steps; infinite: the mean square of whole images exceeds `bound`. The next sample is
  /// prefetched.
  [[nodiscard]] LineSums compare(const Kernels& code, const std::uint16_t* sample, float bound,
                                 const std::uint16_t* next) const noexcept;
  /// Mean square without the cells that are not_observed, after set_frame().
  [[nodiscard]] float observed_mean(const LineSums& sums) const noexcept;

 private:
  /// Sets the next line. Returns the number of cells that the frame fills.
  int set_line(std::span<const float> observed) noexcept;
  void add_line(std::size_t begin, int filled) noexcept;
  void finish() noexcept;

  ShortPrices prices_{};
  float unit_, one_sided_;  // squared depth steps: of ShortPrices; of a cell that only one image fills
  std::vector<std::uint32_t> begins_;
  std::vector<std::uint16_t> observed_, counted_;
  std::vector<float> filled_after_;  // per part; before that, per line, filled cells
  std::size_t count_ = 0;            // of lines
};

/// Removes the evidence of what a frame does not show, where something hides a part of the component: an empty cell is
/// evidence against a sample that fills it only near filled cells, at the silhouette.
class Surroundings {
 public:
  /// Allocates all memory.
  explicit Surroundings(const DepthCamera& camera);
  /// observed: padded_cells() values. Empty cells with no filled cell within `reach` rows and columns become
  /// not_observed. Does not allocate.
  void limit(std::span<float> observed) noexcept;

  static constexpr std::size_t reach = 2;  // cells

 private:
  std::size_t columns_, rows_;
  std::vector<std::uint8_t> filled_, near_;  // of a row, filled_ with margins: 1 or 0
  std::vector<std::uint8_t> along_row_;      // per cell: 1 where a cell of the row within reach is filled
};

/// Residuals of a sample's image, in depth steps, tolerant of edges: sensors widen or shorten edges by a part of a
/// cell. Where one image is empty or the depths differ by more than a cell is wide, the most similar of the 3 x 3 cells
/// of the other image counts, from either image. Returns their mean square over the cells that either fills.
float tolerant_residuals(const Kernels& code, const DepthCamera& camera, const CellPrices& prices,
                         std::span<const float> observed, std::span<const std::uint16_t> image,
                         std::span<float> residuals) noexcept;

/// Of two residuals over the same cells, the least |(1 - t) a + t b|^2 for t in [0, 1], as a share of |a|^2. Frames are
/// also captured between two states of a simulation: this share of the squared residual remains after interpolation.
[[nodiscard]] float share_after_interpolation(const Kernels& code, std::span<const float> a,
                                              std::span<const float> b) noexcept;

/// Per cell of common, padded_cells(): 0 where the image of any of the samples is empty. depths: of all samples.
void find_common(std::span<const std::uint16_t> depths, std::span<const RankedSample> samples,
                 std::span<std::uint16_t> common) noexcept;

/// Plausibility of a sample by its residual r: exp(-sharpness * (r^2 - best^2) / (best^2 + noise^2)).
template <typename Real>
class Plausibility {
 public:
  Plausibility(float best_residual, float noise, float sharpness) noexcept
      : best_(square<Real>(best_residual)), scale_(best_ + square<Real>(noise)), sharpness_{sharpness} {}
  [[nodiscard]] Real operator()(float residual) const noexcept {
    return static_cast<Real>(exponential(-sharpness_ * (square<Real>(residual) - best_) / scale_));
  }

 private:
  Real best_, scale_, sharpness_;
};

}  // namespace lbea
