// Derivatives of a frame's depth image and silhouette by the motion of its cloud.
#pragma once

#include "runtime/src/depth/combination.hpp"
#include "runtime/src/depth/image_comparison.hpp"
#include "runtime/src/depth/pose.hpp"

namespace lbea {

/// A frame and its candidates, best first.
struct PoseProblem {
  std::span<const float> observed;  // padded_cells() depths in steps
  std::span<const float> points;    // cells() numbers of points
  const DepthImages& images;
  std::span<const RankedSample> candidates;  // k
  std::span<const float> residuals;          // k x padded_cells(): sample minus frame, depth steps
  std::span<const float> gram;               // k x k: mean products of the residuals, length unit squared
  std::span<const float> from_best;          // k: distance from the best candidate, length unit
  float cells = 1;                           // that the mean is over
  bool has_silhouette = true;
};

/// Derivatives of a frame's depth image by the motion of its cloud.
class PoseDerivatives {
 public:
  /// Allocates all memory. one_sided: cost of a cell that only one image fills, in depth steps.
  PoseDerivatives(const DepthCamera& camera, const PoseCenter& center, float one_sided);
  void build(const PoseProblem& problem) noexcept;
  /// 6 x padded_cells(): depth steps per length. 0 where the surface is too steep or not known, and in cells that a
  /// candidate does not fill: their costs are no differences of depth.
  [[nodiscard]] std::span<const float> of_depths() const noexcept { return of_depths_; }

  /// A cell near the silhouette. Its cost is in proportion to the share of it that only one image fills.
  struct EdgeCell {
    std::uint32_t cell;
    bool has_depth;                   // of_depths() counts, too
    float share;                      // that the frame fills
    std::array<float, 6> derivative;  // of the cost, depth steps per length
  };
  [[nodiscard]] std::span<const EdgeCell> edges() const noexcept { return edges_; }

 private:
  struct Window {
    float filled = 0, depths = 0, inside = 0, points = 0, hidden = 0;  // cells, their depths; cells and points inside
    void operator+=(const Window& other) noexcept;
  };
  [[nodiscard]] bool is_dense(std::span<const float> observed) const noexcept;
  [[nodiscard]] bool is_inside(std::span<const float> observed, std::size_t cell) const noexcept;
  void sum_windows(const PoseProblem& problem) noexcept;
  void sum_cells() noexcept;
  /// Returns whether there is a derivative.
  bool add_depth(std::span<const float> observed, std::uint32_t row, std::uint32_t column) noexcept;
  void add_edge(std::span<const float> points, std::uint32_t row, std::uint32_t column, bool has_depth) noexcept;
  [[nodiscard]] std::array<float, 2> ray(std::uint32_t row, std::uint32_t column) const noexcept;
  [[nodiscard]] std::array<float, 6> derivative(std::array<float, 2> ray, float depth,
                                                const std::array<float, 3>& by_shift) const noexcept;

  [[nodiscard]] std::size_t padded(std::size_t row, std::size_t column) const noexcept {
    return (row + margin) * stride_ + column + margin;
  }

  static constexpr std::size_t reach = 2, margin = reach + 1;  // of the windows of 5 x 5 cells; empty, around the image
  DepthCamera camera_;
  PoseCenter center_;
  float one_sided_;
  std::vector<float> of_depths_;
  std::vector<std::uint16_t> common_;  // per cell: 0 where the image of any candidate is empty
  std::size_t stride_;
  std::vector<Window> cells_, in_row_, windows_;  // per padded cell: its own, summed along the row, over the window
  std::vector<EdgeCell> edges_;
  float points_when_full_ = 0;  // of a cell: where no cell inside is near
};

}  // namespace lbea
