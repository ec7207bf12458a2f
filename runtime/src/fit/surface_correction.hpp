// Method::fit: moves the estimate to the points of the frame. The image of a blend of shapes is not the blend of their
// images, where folds lie elsewhere.
#pragma once

#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/fit/shape_estimate.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/shape_landmarks.hpp"

namespace lbea {

class SurfaceCorrection {
 public:
  /// Keeps references to the model and to the camera. mesh_noise: of the metric, length unit. Allocates all memory.
  SurfaceCorrection(const ModelView& model, const DepthCamera& camera, float mesh_noise, const FitSettings& settings);

  /// Weights of the estimate's samples, whose sum is 1, that bring its observed surface nearer to the frame's points: a
  /// Gauss-Newton step on the distances from the planes through the points that the camera sees at the same places
  /// (Chen and Medioni 1992), with a shift of the whole component as a nuisance, regularized by ridge regression about
  /// the estimate. observed: the frame's depth image in steps. Empty if the frame shows nothing near the estimate.
  /// Valid until the next call. Does not allocate.
  [[nodiscard]] std::span<const float> correct(const CloudIndex& index, std::span<const float> observed,
                                               const ShapeEstimate& estimate) noexcept;

 private:
  using Vector = std::array<float, 3>;

  void combine(const ShapeEstimate& estimate) noexcept;
  void measure(const CloudIndex& index, std::span<const float> observed) noexcept;
  void measure(std::size_t node, const CloudIndex& index, std::span<const float> observed) noexcept;
  [[nodiscard]] float depth_at(const Vector& sight, float depth, std::span<const float> observed) const noexcept;
  void weigh_robustly() noexcept;
  [[nodiscard]] float set_rows(const ShapeEstimate& estimate) noexcept;
  void eliminate_shift(std::size_t samples, float price) noexcept;
  [[nodiscard]] std::span<const float> solve(std::span<const WeightedSample> before, float price) noexcept;
  [[nodiscard]] std::span<const float> landmarks(std::uint32_t sample) noexcept {
    return shapes_.of(sample, true, buffer_);
  }
  [[nodiscard]] std::span<float> row(std::size_t sample) noexcept {
    return std::span(rows_).subspan(sample * shapes_.stride(), shapes_.stride());
  }

  const DepthCamera& camera_;
  const Kernels& code_;
  float price_, shift_;
  ShapeLandmarks shapes_;
  std::size_t measured_ = 0;                     // nodes
  std::vector<float> buffer_, shape_, normals_;  // of the nodes: x, y and z planes; a normal of 0: not measured
  std::vector<float> distances_;                 // of the nodes from the planes, along the normals
  std::vector<float> rows_;                      // per sample: changes of these distances with its weight
  std::vector<float> gram_, products_;           // of the samples
  std::vector<float> shifts_;                    // per axis: products of a shift and the samples
  std::vector<float> weights_;
  std::vector<double> changes_;
  RidgeProblem ridge_;
};

}  // namespace lbea
