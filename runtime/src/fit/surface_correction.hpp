// Method::fit: moves the estimate to the points of the frame. The image of a blend of shapes is not the blend of their
// images, where folds lie elsewhere.
#pragma once

#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/fit/shape_estimate.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/match/shape_landmarks.hpp"
#include "runtime/src/model/run_samples.hpp"

namespace lbea {

inline constexpr std::size_t most_rigs = 16;  // of a RigMatcher

/// Of the last frame, if it shows something, per place of the observed surface: the distance of a plane through the
/// points from the estimate, along its normal, or at an open edge of the mesh that of the place where the points end,
/// along the surface; and how it changes with the weights of the estimate's samples. Multiplied by the roots of robust
/// weights. Planes of x, y and z; 0: not measured.
struct SurfaceEquations {
  std::span<const float> shape, directions;  // 3 x stride; 4 x stride: the last plane is the length at edges alone
  std::span<const float> distances, rows;    // stride; samples x stride
  std::size_t samples, nodes, measured;
  float squares;  // the samples' mean squared distance from the estimate
};

class SurfaceCorrection {
 public:
  /// Keeps a reference to the model. mesh_noise: of the metric, length unit. Allocates all memory.
  SurfaceCorrection(const ModelView& model, float mesh_noise, const FitSettings& settings);

  /// What a rig shows of the estimated shape. depth: the frame's depth image in steps. states: of the estimate's
  /// samples when the rig captured the frame; empty: those samples.
  struct Observation {
    const CloudIndex& index;
    const DepthCamera& camera;
    std::span<const float> depth;
    std::span<const StateBetween> states{};
  };

  /// Forgets the frames.
  void clear() noexcept { rigs_ = measured_ = 0; }
  /// Whether the last frame shows something near the estimate.
  [[nodiscard]] bool shows_something() const noexcept { return measured_ > 0; }
  /// Begins the correction of an estimate, which must remain until it is solved. Does not allocate.
  void begin(const ShapeEstimate& estimate) noexcept;
  /// Adds the frame of a rig: the distances of the estimate's surface from planes through the points that the camera
  /// sees at the same places (Chen and Medioni 1992). Does not allocate.
  void add(const Observation& seen) noexcept;
  /// Adds the frame of another rig, which `other` was begun with, of the same estimate. Does not allocate.
  void join(const SurfaceCorrection& other) noexcept;
  /// Weights of the estimate's samples, whose sum is 1, that bring its observed surface nearer to the points of all
  /// frames: a Gauss-Newton step on these distances, regularized by ridge regression about the estimate. Nuisances
  /// per rig: a shift of the whole component, and how far before the edges its points end. may_be_sample: one sample
  /// gets the weight 1, and the others 0, if the points are likelier with it than with all combinations. Empty if the
  /// frames show nothing near the estimate. Valid until the next begin(). Does not allocate.
  [[nodiscard]] std::span<const float> solve(bool may_be_sample) noexcept;
  /// Of the last frame that was added, not of joined ones. Valid until the next add().
  [[nodiscard]] SurfaceEquations equations() const noexcept;
  /// The estimate's places on the observed surface, before the correction: planes of x, y and z.
  [[nodiscard]] std::span<const float> surface() const noexcept { return shape_; }
  /// Their number, without those at edges.
  [[nodiscard]] std::size_t surface_places() const noexcept { return shapes_.nodes() - 3 * shapes_.edges(); }
  /// Floats of a plane of nodes.
  [[nodiscard]] std::size_t stride() const noexcept { return shapes_.stride(); }

 private:
  static constexpr std::size_t nuisances = 4;  // shift x, y, z; length lost before edges
  /// Of a rig: their normal equations with each other and with the samples' weights.
  struct Nuisances {
    std::array<std::array<float, nuisances>, nuisances> matrix;
    std::array<float, nuisances> constant;
    float* samples;  // nuisances x k
  };

  void combine(std::span<const StateBetween> states) noexcept;
  void measure(const Observation& seen) noexcept;
  void measure(std::size_t node, const Observation& seen) noexcept;
  void measure_edge(std::size_t edge, const Observation& seen) noexcept;
  void weigh_robustly() noexcept;
  [[nodiscard]] float set_rows(std::span<const StateBetween> states) noexcept;
  void add_products(Nuisances& of_rig) noexcept;
  void eliminate(Nuisances& of_rig, float price) noexcept;
  [[nodiscard]] double solve_ridge(float price) noexcept;
  [[nodiscard]] std::optional<std::size_t> likely_sample(double left, float price, double rounding) const noexcept;
  [[nodiscard]] std::span<const float> weights_of(std::size_t sample) noexcept;
  [[nodiscard]] std::span<const float> weights_by_changes() noexcept;
  [[nodiscard]] std::span<const float> shape_of(std::size_t sample, std::span<const StateBetween> states) noexcept;
  [[nodiscard]] std::size_t first_edge() const noexcept { return shapes_.nodes() - shapes_.edges(); }
  void set(std::size_t node, const std::array<float, 3>& direction, float distance) noexcept;
  [[nodiscard]] std::span<float> row(std::size_t sample) noexcept {
    return std::span(rows_).subspan(sample * shapes_.stride(), shapes_.stride());
  }

  const Kernels& code_;
  float price_, shift_, strip_;
  ShapeLandmarks shapes_;
  const ShapeEstimate* estimate_ = nullptr;
  std::size_t samples_ = 0;                      // of the estimate when it was begun
  std::size_t measured_ = 0, all_measured_ = 0;  // nodes: of the last rig, of all
  std::size_t rigs_ = 0;                         // that show something
  float own_squares_ = 0, squares_ = 0;          // set_rows() of the last rig, sum of all
  float distance_squares_ = 0;                   // sum of the squared distances, all rigs
  std::vector<float> buffer_, shape_;            // of the nodes: x, y and z planes
  std::vector<float> directions_, distances_;    // as those of the equations
  std::vector<float> rows_;                      // per sample: changes of these distances with its weight
  std::vector<float> gram_, products_;           // of the samples, all rigs; of the gram the upper half
  std::vector<float> sums_;                      // of a rig
  std::array<Nuisances, most_rigs> nuisances_{};
  std::vector<float> of_nuisances_;  // their products with the samples
  std::vector<float> weights_;
  std::vector<double> changes_;
  RidgeProblem ridge_;
};

}  // namespace lbea
