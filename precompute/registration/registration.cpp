#include "precompute/registration/registration.hpp"

#include "precompute/registration/alignment.hpp"

#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace lbea {

namespace {

constexpr std::size_t least_points = 100;
constexpr double degrees = 180 / std::numbers::pi;
// What is left after alignment is mostly no noise but shape, the same over whole faces: as telling as so many independent
// measurements.
constexpr double independent_residuals = 25;
constexpr std::size_t finalists = 5;

std::vector<Eigen::Vector3d> spread(std::span<const Point> points, std::size_t most) {
  std::vector<Eigen::Vector3d> finite, chosen;
  for (const Point& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z)) finite.emplace_back(double{p.x}, double{p.y}, double{p.z});
  const std::size_t count = std::min(most, finite.size());
  for (std::size_t i = 0; i < count; ++i) chosen.push_back(finite[i * finite.size() / count]);
  return chosen;
}

Eigen::Vector3d middle(const std::vector<Eigen::Vector3d>& points) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const auto& p : points) sum += p;
  return sum / static_cast<double>(points.size());
}

double arm(const std::vector<Eigen::Vector3d>& points) {
  const Eigen::Vector3d centre = middle(points);
  double squares = 0;
  for (const auto& p : points) squares += (p - centre).squaredNorm();
  return std::sqrt(squares / static_cast<double>(points.size()));
}

/// Root mean square distance between where two poses put the points.
double apart(const Eigen::Isometry3d& a, const Eigen::Isometry3d& b, const std::vector<Eigen::Vector3d>& points) {
  double squares = 0;
  for (const auto& p : points) squares += (a * p - b * p).squaredNorm();
  return std::sqrt(squares / static_cast<double>(points.size()));
}

/// The rough pose, and the same shifted and turned both ways along and about each axis.
std::vector<Eigen::Isometry3d> starts(const Eigen::Isometry3d& rough, const Eigen::Vector3d& centre, const RegistrationSettings& settings) {
  std::vector<Eigen::Isometry3d> poses{rough};
  for (Eigen::Index axis = 0; axis < 6; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Vector6 motion = Vector6::Zero();
      motion(axis) = sign * 0.7 * (axis < 3 ? settings.rough_turn_deg / degrees : settings.rough_shift);
      poses.push_back(motion_about(centre, 1, motion) * rough);
    }
  return poses;
}

/// Seen from any of the poses.
std::vector<std::uint8_t> seen_from(const ReferenceSurface& surface, const std::vector<Eigen::Isometry3d>& poses) {
  std::vector<std::uint8_t> seen;
  if (!surface.visible) return seen;
  seen.assign(surface.elements.size(), 0);
  for (const auto& pose : poses) {
    const auto now = surface.visible(to_transform(pose));
    for (std::size_t e = 0; e < seen.size(); ++e) seen[e] |= now[e];
  }
  return seen;
}

/// Distance between neighbouring points where the cloud lies on the surface: from the area it covers.
double spacing_of(std::span<const Point> points, const ReferenceSurface& surface, const std::vector<std::uint8_t>& seen) {
  double area = 0;
  const auto corner = [&](std::size_t e, std::size_t k) {
    const float* p = &surface.positions[3 * std::size_t{surface.elements[e][k]}];
    return Eigen::Vector3d(double{p[0]}, double{p[1]}, double{p[2]});
  };
  for (std::size_t e = 0; e < surface.elements.size(); ++e)
    if (seen.empty() || seen[e] != 0) area += 0.5 * (corner(e, 2) - corner(e, 0)).cross(corner(e, 3) - corner(e, 1)).norm();
  return std::sqrt(area / static_cast<double>(std::max<std::size_t>(points.size(), 1)));
}

LeastCertain least_certain(const AlignmentState& state, double arm_length, const RegistrationSettings& settings) {
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(state.normal);
  const Vector6 motion = solver.eigenvectors().col(0);
  LeastCertain least;
  for (std::size_t i = 0; i < 3; ++i) {
    least.turn[i] = motion(static_cast<Eigen::Index>(i)) / arm_length;
    least.shift[i] = motion(static_cast<Eigen::Index>(i + 3));
  }
  least.sensitivity = std::sqrt(std::max(solver.eigenvalues()(0), 0.0));
  least.deviation = std::max(state.residual, settings.noise) / (std::sqrt(independent_residuals) * std::max(least.sensitivity, 1e-12));
  return least;
}

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

class Registrar {
 public:
  Registrar(const ReferenceSurface& surface, std::span<const Point> points, const RigidTransform& rough, const RegistrationSettings& settings)
      : surface_(surface), cloud_(points), settings_(settings), rough_(to_isometry(rough)), points_(spread(points, settings.points)) {
    if (points_.size() < least_points)
      throw Error(Status::bad_input, "the cloud has " + std::to_string(points_.size()) + " points; registration needs at least " + std::to_string(least_points));
  }

  Registration run() {
    const auto from = starts(rough_, rough_ * middle(points_), settings_);
    const std::size_t coarse = std::max<std::size_t>(1, points_.size() / settings_.coarse_points);
    const double reach = settings_.rough_shift, fine = std::max(5 * settings_.noise, 0.05 * settings_.tolerance);
    const std::array<double, 3> first{reach, reach / 3, reach / 10};
    std::vector<AlignmentState> ends = align_all(from, from, first, coarse);
    std::ranges::stable_sort(ends, {}, &AlignmentState::cost);
    std::vector<Eigen::Isometry3d> best;
    for (const AlignmentState& end : ends) best.push_back(end.pose);
    const std::array<double, 3> last{reach / 10, std::sqrt(reach / 10 * fine), fine};
    std::vector<AlignmentState> refined = align_all(distinct(best), {best.front()}, last, 1);
    std::ranges::stable_sort(refined, {}, &AlignmentState::cost);
    return report(refined, ends);
  }

 private:
  std::vector<AlignmentState> align_all(const std::vector<Eigen::Isometry3d>& from, const std::vector<Eigen::Isometry3d>& viewpoints,
                                        std::span<const double> scales, std::size_t every) {
    const auto seen = seen_from(surface_, viewpoints);
    const SurfaceTree tree(surface_.positions, surface_.elements, seen);
    if (tree.triangles() == 0)
      throw Error(Status::bad_input, surface_.visible ? "from the rough pose the rig sees nothing of the reference mesh; check T_reference_sensor"
                                                      : "the reference mesh has no surface");
    const double spacing = spacing_of(cloud_, surface_, seen);
    // The spacing of the points that are used, not of the cloud's: what lies between an edge and the nearest of them.
    const double used = spacing * std::sqrt(static_cast<double>(cloud_.size()) / static_cast<double>(points_.size()));
    const Alignment alignment(tree, free_edges(surface_.positions, surface_.elements, seen, 2 * used), points_, used);
    std::vector<AlignmentState> ends;
    for (const auto& pose : from) ends.push_back(alignment.align(pose, scales, every));
    return ends;
  }

  /// The best few that are not the same.
  [[nodiscard]] std::vector<Eigen::Isometry3d> distinct(const std::vector<Eigen::Isometry3d>& ranked) const {
    std::vector<Eigen::Isometry3d> chosen;
    for (const auto& pose : ranked)
      if (chosen.size() < finalists && std::ranges::all_of(chosen, [&](const auto& other) { return apart(pose, other, points_) > settings_.tolerance; }))
        chosen.push_back(pose);
    return chosen;
  }

  [[nodiscard]] Registration report(const std::vector<AlignmentState>& refined, const std::vector<AlignmentState>& coarse) const {
    const AlignmentState& best = refined.front();
    const auto near = static_cast<std::size_t>(best.counted * static_cast<double>(points_.size()));
    if (near < least_points)
      throw Error(Status::bad_input, "after alignment only " + std::to_string(near) + " of " + std::to_string(points_.size()) +
                                         " points lie near the reference mesh; is this frame of the undeformed component, and the rough pose within " +
                                         format("%g and %g degrees?", settings_.rough_shift, settings_.rough_turn_deg));
    Registration result;
    result.T_reference_sensor = to_transform(best.pose);
    result.residual = best.residual;
    result.counted = best.counted;
    const Eigen::Vector3d centre = middle(points_);
    result.shift = (best.pose * centre - rough_ * centre).norm();
    result.turn_deg = Eigen::AngleAxisd(best.pose.linear() * rough_.linear().transpose()).angle() * degrees;
    const auto same = std::ranges::count_if(coarse, [&](const AlignmentState& end) { return apart(end.pose, best.pose, points_) <= 2 * settings_.tolerance; });
    result.agreeing = static_cast<double>(same) / static_cast<double>(coarse.size());
    result.least_certain = least_certain(best, arm(points_), settings_);
    result.doubt = doubt(refined, result.least_certain);
    return result;
  }

  [[nodiscard]] std::string doubt(const std::vector<AlignmentState>& refined, const LeastCertain& least) const {
    if (least.deviation > settings_.tolerance)
      return format("the cloud hardly tells a motion of (%.2f, %.2f, %.2f) with a turn about (%.4f, %.4f, %.4f) rad per unit: it changes the distances by a "
                    "share of %.3f only, and stays uncertain by %.2g",
                    least.shift[0], least.shift[1], least.shift[2], least.turn[0], least.turn[1], least.turn[2], least.sensitivity, least.deviation);
    const AlignmentState& best = refined.front();
    for (std::size_t i = 1; i < refined.size(); ++i) {
      const double away = apart(refined[i].pose, best.pose, points_);
      if (away > settings_.tolerance && refined[i].cost < 1.5 * best.cost + settings_.noise * settings_.noise)
        return format("another pose, %.2g away, explains the cloud as well (residuals %.3g and %.3g)", away, best.residual, refined[i].residual);
    }
    return "";
  }

  const ReferenceSurface& surface_;
  std::span<const Point> cloud_;
  const RegistrationSettings& settings_;
  Eigen::Isometry3d rough_;
  std::vector<Eigen::Vector3d> points_;  // sensor coordinates
};

}  // namespace

Registration register_cloud(const ReferenceSurface& surface, std::span<const Point> points, const RigidTransform& rough,
                            const RegistrationSettings& settings) {
  return Registrar(surface, points, rough, settings).run();
}

}  // namespace lbea
