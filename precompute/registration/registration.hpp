// Refines a rough T_reference_sensor from a cloud of the undeformed component, and detects when the cloud does not
// determine it.
#pragma once

#include <lbea/lbea.hpp>

#include <functional>
#include <optional>

namespace lbea::bake {
/// The undeformed component; the caller owns the memory.
struct ReferenceSurface {
  std::span<const float> positions;                        // nodes x 3, reference coordinates
  std::span<const std::array<std::uint32_t, 4>> elements;  // a triangle repeats its last node
  /// How the shape may differ: each nodes x 3, one standard deviation; estimated together with the pose.
  std::span<const std::vector<float>> modes{};
  /// One per element, 1 = the rig sees it from this pose. Not set: all are seen.
  std::function<std::vector<std::uint8_t>(const RigidTransform& T_reference_sensor)> visible{};
};

struct RegistrationSettings {
  double noise = 0.1;       // standard deviation of a point along the line of sight, length unit
  double rough_shift = 20;  // how far off the given pose may be, length unit
  double rough_turn_deg = 5;
  double tolerance = 1;               // length unit: poses that move the component by more than this are different ones
  std::uint32_t points = 4'000;       // of the cloud, in the last rounds
  std::uint32_t coarse_points = 500;  // in the first
};

/// The motion of the component that the cloud determines least.
struct LeastCertain {
  std::array<double, 3> turn{};   // axis times share, per unit of motion
  std::array<double, 3> shift{};  // reference coordinates, per unit of motion
  double sensitivity = 0;         // root mean square change of the distances per root mean square motion of the points
  double deviation = std::numeric_limits<double>::infinity();  // of the points along it, length unit
};

struct Registration {
  RigidTransform T_reference_sensor = identity_transform;
  double residual = 0;        // root mean square distance of the counted points from the surface, length unit
  double counted = 0;         // share of the points that lie near the surface
  double shift = 0;           // of the cloud's middle from where the rough pose put it, length unit
  double turn_deg = 0;        // from the rough pose
  std::vector<double> shape;  // coefficients of the modes, in standard deviations
  double agreeing = 0;        // share of the starts that end at this pose
  LeastCertain least_certain;
  std::string doubt;  // why the pose is ambiguous, a sentence; empty: it is not
  [[nodiscard]] bool ambiguous() const noexcept { return !doubt.empty(); }
};

/// Robust point-to-plane alignment, coarse to fine, from several starts around the rough pose. Free edges of the
/// surface are used too: the cloud ends where they do. points: sensor coordinates, of one or several undeformed frames.
/// Throws Error{bad_input} when the surface is empty or less than a hundred points are near it.
[[nodiscard]] Registration register_cloud(const ReferenceSurface& surface, std::span<const Point> points,
                                          const RigidTransform& rough, const RegistrationSettings& settings = {});

/// Sizes that differ by a factor of about 10, 100 or 1000 indicate different units: the factor from the cloud's unit to
/// the mesh's. Box diagonals; the cloud's without the outermost hundredth of its points along each axis.
[[nodiscard]] std::optional<double> unit_factor(double cloud_diagonal, double mesh_diagonal);
/// Points that are more than ten times as far from the middle of the cloud as four fifths of the points, as numbers
/// that stand for missing values are.
[[nodiscard]] std::vector<Point> far_points(std::span<const Point> points);

/// Why the found pose is doubtful: it is farther from the rough pose than was searched; empty when it is not.
[[nodiscard]] std::string beyond_range(const Registration& found, const RegistrationSettings& settings);
/// Why the found pose is doubtful: many points are not on the component; empty when few are.
[[nodiscard]] std::string unexplained_points(const Registration& found);
[[nodiscard]] double robust_diagonal(std::span<const Point> points);
[[nodiscard]] double box_diagonal(std::span<const float> positions);

/// How undeformed shapes differ: their mean and the few ways in which they vary most.
struct ShapeModes {
  std::vector<float> mean;                // nodes x 3
  std::vector<std::vector<float>> modes;  // each nodes x 3, one standard deviation large; most varying first
};

/// Principal components of shapes with the same nodes. Modes that move the nodes by less than `least` (root mean
/// square) are left out, and all beyond the first `most`. One shape alone has no modes.
[[nodiscard]] ShapeModes shape_modes(std::span<const std::span<const float>> shapes, double least,
                                     std::size_t most = 6);
}  // namespace lbea::bake
