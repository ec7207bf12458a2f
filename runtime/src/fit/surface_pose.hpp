// What the points of a frame say about its pose: the rigid motion and the weights of the estimate's samples are
// estimated together, from the distances of the estimated surface from the points.
#pragma once

#include "runtime/src/fit/surface_correction.hpp"
#include "runtime/src/pose/pose_filter.hpp"

namespace lbea {

class SurfacePose {
 public:
  /// mesh_noise: of the metric, length unit. stride: of SurfaceEquations. Allocates all memory.
  SurfacePose(const PoseCenter& center, float mesh_noise, std::size_t stride, const FitSettings& settings);

  /// The motion that the cloud lacks. Equations of nodes at which the samples differ count less (generalized least
  /// squares): there the unknown shape is more uncertain than the points. calibration: variance per component, the
  /// bound of what is not measured. Does not allocate.
  [[nodiscard]] PoseMeasurement measure(const SurfaceEquations& equations, const PoseMotion& calibration) noexcept;

 private:
  /// Sums over the nodes.
  struct Sums {
    float normals = 0, squares = 0;  // squared lengths of the normals; squared distances
  };
  [[nodiscard]] Sums weigh(const SurfaceEquations& equations) noexcept;
  void set_motions(const SurfaceEquations& equations) noexcept;
  void add_products() noexcept;
  void eliminate_weights(float price) noexcept;
  [[nodiscard]] std::span<double> solved(std::size_t m) noexcept {
    return std::span(solved_).subspan(m * unknowns_, unknowns_);
  }

  const Kernels& code_;
  PoseCenter center_;
  float noise_, price_, strip_;
  std::size_t stride_, samples_ = 0, unknowns_ = 0;  // one more unknown: the length lost before edges
  std::vector<float> roots_;                         // of the nodes' weights
  std::vector<float> rows_, motions_;                // per unknown, per motion: changes of the distances; weighed
  std::vector<float> distances_;                     // weighed
  std::vector<float> gram_, sums_;                   // of the unknowns; with one of them, or prices
  std::vector<float> products_;                      // 7 x k: of the motions and the distances with the unknowns
  std::vector<double> solved_;                       // 7 x k
  PoseMatrix information_{};                         // of the motions; then without what the weights explain
  PoseMotion sum_{};                                 // their products with the distances; the same
  RidgeProblem ridge_;
};

}  // namespace lbea
