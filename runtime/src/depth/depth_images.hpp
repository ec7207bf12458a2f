// Depth images, coarse enough to compare hundreds per frame: what the sensor would see of each sample, and what it saw
// in the frame.
#pragma once

#include "runtime/src/depth/combination.hpp"
#include "runtime/src/depth/pose.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/model/model_format.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cmath>
#include <optional>

namespace lbea {

class SectionReader;

template <typename Real = float>
[[nodiscard]] constexpr Real square(float v) noexcept {
  return Real{v} * Real{v};
}

struct CameraPlace {
  float depth;       // along the optical axis, length unit
  std::size_t cell;  // outside the image: the number of cells
};

/// The sensor's left camera with its pixels combined into square cells. Cell (0, 0) is the corner of the part of the
/// image that any sample can fill.
struct DepthCamera {
  RigidTransform T_reference_sensor = identity_transform;
  float focal = 0;                          // in cells
  float center_column = 0, center_row = 0;  // of the principal point, in cells from the corner
  float depth_origin = 0, depth_step = 1;   // depth = origin + step * stored value, length unit
  std::uint32_t columns = 0, rows = 0;

  [[nodiscard]] std::size_t cells() const noexcept { return std::size_t{columns} * rows; }
  /// Where the camera sees a position of the reference frame.
  [[nodiscard]] CameraPlace place_of(const std::array<float, 3>& position) const noexcept;
};

/// Each image is padded with empty cells to whole 64-byte lines.
[[nodiscard]] constexpr std::size_t padded_cells(std::size_t cells) noexcept { return (cells + 31) / 32 * 32; }
[[nodiscard]] inline std::size_t padded_cells(const DepthCamera& camera) noexcept {
  return padded_cells(camera.cells());
}
inline constexpr std::uint16_t empty_cell = 0;
/// The last three bits of a stored depth: the share of the cell that the sensor sees, in sevenths. That changes the
/// depth by no more than seven steps.
inline constexpr std::uint16_t fill_levels = 7;
[[nodiscard]] constexpr std::uint16_t depth_with_share(double steps, double share) noexcept {
  const auto depth = static_cast<std::uint16_t>(steps), level = static_cast<std::uint16_t>(share * fill_levels + 0.5);
  return static_cast<std::uint16_t>((depth & ~fill_levels) | (level < 1 ? 1 : level > 7 ? 7 : level));
}
[[nodiscard]] constexpr float share_of(std::uint16_t stored) noexcept {
  return static_cast<float>(stored & fill_levels) / fill_levels;
}

/// How two depth images are compared. The bake learns the costs from left-out runs; these are the defaults.
struct DepthMetric {
  float cap = 40;        // mm: greatest cost of a cell that both images fill
  float one_sided = 25;  // cost of a cell that only one image fills: the silhouette
  float mesh_noise = 1;  // residual between a frame and its own sample, from sampling a curved surface by cells
  float hidden = 9.4f;   // cost of an empty cell of a frame in a part that something may hide: see HiddenParts

  /// The same in another unit.
  [[nodiscard]] DepthMetric in(std::string_view length_unit) const noexcept {
    const auto scale = static_cast<float>(units_per_mm(length_unit));
    return {scale * cap, scale * one_sided, scale * mesh_noise, scale * hidden};
  }
};

/// What the bake learned about shapes from whole images; see ShapePredictor. Image scores and shape scores are
/// principal components; those of shapes are of node positions, so that their distances are root mean square distances
/// of nodes.
struct ShapeRegression {
  static constexpr std::size_t image_scores = 128, shape_scores = 48, most_images = 2048;
  std::span<const float> basis;    // (2 + image_scores) x features(): typical depths, mean, principal components
  std::span<const float> images;   // t x image_scores: of the images that it was trained with
  std::span<const float> weights;  // shape_scores x padded(t): of their kernels
  std::span<const float> shapes;   // s x shape_scores: of all samples, length unit
  float one_sided = 0;             // depth steps: feature of an empty window
  float length_scale = 0;          // of the kernel
  float blend = 0;                 // the estimate goes this share of the way to the prediction; 0: not trained
  float most_difference = 0;       // length unit: 98 % of predictions and combinations differ by less than this
  float hidden_blend = 0, hidden_most_difference = 0;  // the same of frames of which something hides a part

  /// Features of an image, padded with zeros to whole 64-byte lines.
  [[nodiscard]] static std::size_t features(const DepthCamera& camera) noexcept {
    return format::padded(std::size_t{2} * ((camera.columns + 1) / 2) * ((camera.rows + 1) / 2));
  }
  [[nodiscard]] std::span<const float> typical(std::size_t features) const noexcept { return basis.first(features); }
  [[nodiscard]] std::span<const float> mean(std::size_t features) const noexcept {
    return basis.subspan(features, features);
  }
  [[nodiscard]] std::span<const float> components(std::size_t features) const noexcept {
    return basis.subspan(2 * features);
  }
  [[nodiscard]] std::span<const float> shape(std::size_t sample) const noexcept {
    return shapes.subspan(sample * shape_scores, shape_scores);
  }
  /// Number of training images of an ensemble.
  [[nodiscard]] static std::size_t trained_with(std::size_t samples) noexcept {
    return std::min(2 * samples, most_images);
  }
};

/// The 90 % bound of an estimate's mean error e by its spread s: e = per_spread s (s / typical)^growth. Errors of runs
/// that are not in the ensemble grow faster than the spread, or more slowly.
struct ErrorBound {
  double per_spread = 0;  // 0: not known
  double growth = 0;
  double typical = 1;  // spread, length unit

  [[nodiscard]] double per_spread_at(double spread) const noexcept;
};

/// The 90 % bound of single values: per_spread times the evened spread (see even_out()) times error_90 over spread.
struct SpreadBound {
  double share = 0, per_spread = 0;  // per_spread 0: not known
};

/// The weight of a frame's misfit in that of its test: one over the squares of the mesh noise and of the frame's
/// expected residual, at least a quarter of the greatest one of the ensemble; length unit. Otherwise a first frame,
/// whose expected residual is small, would almost decide alone.
[[nodiscard]] inline double misfit_weight(float expected, float greatest, float mesh_noise) noexcept {
  constexpr float least = 0.25f;
  return 1 / (square<double>(std::max(expected, least * greatest)) + square<double>(mesh_noise));
}

/// What SensorViews shares: the images of all samples and the residuals to expect.
struct DepthImages {
  DepthCamera camera;
  std::span<const std::uint16_t> depths;  // s x padded_cells
  // s: median residual of a run that is not in the ensemble, at this time step, as tolerant_residuals(); empty: unknown
  std::span<const float> expected{};
  DepthMetric metric;  // length unit
  EstimatePrices prices{};
  float misfit_limit = 0;       // of one frame
  float test_misfit_limit = 0;  // of the geometric mean over a test
  // 90 % of the estimates' errors are below this times the spread; 0: not known
  ErrorBound error_bound{};         // of whole frames
  ErrorBound hidden_error_bound{};  // of frames of which something hides a part
  // How much a run that is not in the ensemble looks like a moved one: see PoseFit. 0: not known, the pose is not
  // estimated
  float pose_variance = 0;
  PoseErrors pose_errors{};  // of poses by the image
  // Of poses by the points; drift_evidence: of both together. Nothing: not known
  std::optional<PoseErrors> pose_errors_by_points{};
  // How much later or earlier than a frame the samples like it are, as a share of the time since the impact, root mean
  // square over runs that are not in the ensemble. 0: not known
  float time_variation = 0;
  ShapeRegression regression{};
  std::vector<SpreadBound> bounds{};    // of node positions, then of each field; empty: not known
  std::shared_ptr<const void> owner{};  // of the memory behind the spans

  [[nodiscard]] std::span<const std::uint16_t> of_sample(std::size_t sample) const noexcept {
    const std::size_t stride = padded_cells(camera);
    return depths.subspan(sample * stride, stride);
  }
  /// The settings with these prices.
  [[nodiscard]] FitSettings priced(FitSettings settings) const noexcept {
    settings.prices = prices;
    return settings;
  }
};

/// Reads sections 64 to 66 and 0x8001 to 0x800B and 0x8011 to 0x8014 of a rig. Null when the file has none. Throws
/// Error{corrupt_model}.
[[nodiscard]] std::shared_ptr<const DepthImages> read_depth_images(const SectionReader& reader,
                                                                   const format::Info& info,
                                                                   std::string_view length_unit, std::uint32_t rig);

/// The frame as the camera of the samples' depth images would have taken it.
class FrameDepthImage {
 public:
  /// Allocates all memory.
  explicit FrameDepthImage(const DepthCamera& camera);

  /// Sets every cell to the mean depth of the indexed points in it, in depth steps. A cell with less than a quarter of
  /// the points that a filled cell holds on average becomes nothing_seen: a single outlier at an edge is no surface.
  /// Does not allocate.
  void build(const CloudIndex& index) noexcept;
  /// padded_cells() values.
  [[nodiscard]] std::span<float> cells() noexcept { return cells_; }
  /// cells() numbers of points.
  [[nodiscard]] std::span<const float> points() const noexcept { return points_; }
  /// Whether a filled cell holds less than 1 / (1 - exp(-1)) points on average, as with less than one independent point
  /// per cell.
  [[nodiscard]] bool is_sparse() const noexcept { return is_sparse_; }

 private:
  CellRaster raster_;
  RigidTransform T_sensor_reference_;
  std::vector<CellTally> tallies_;  // one more than there are cells, for points outside
  std::vector<float> points_, cells_;
  bool is_sparse_ = false;
};

}  // namespace lbea
