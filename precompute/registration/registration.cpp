#include "precompute/registration/registration.hpp"

#include "precompute/registration/alignment.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <numbers>

namespace lbea::bake {
namespace {
constexpr std::size_t least_points = 100;
constexpr double degrees = 180 / std::numbers::pi;
// Residuals after alignment are mostly shape differences, correlated over whole faces: they carry the information of so
// many independent measurements.
constexpr double independent_residuals = 25;
constexpr std::size_t finalists = 5;
constexpr int shape_rounds = 20;

std::vector<Eigen::Vector3d> finite(std::span<const Point> points) {
  std::vector<Eigen::Vector3d> kept;
  for (const Point& p : points)
    if (std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z))
      kept.emplace_back(double{p.x}, double{p.y}, double{p.z});
  return kept;
}

/// A pose under refinement, and its shape.
struct Candidate {
  Eigen::Isometry3d pose;
  Eigen::VectorXd shape;           // coefficients of the modes
  AlignmentEquations equations{};  // at this pose and shape
};

/// The rough pose, and the same turned and shifted both ways about and along each axis.
std::vector<Candidate> starts(const Eigen::Isometry3d& rough, const Eigen::Vector3d& centre, std::size_t modes,
                              const RegistrationSettings& settings) {
  const Eigen::VectorXd mean_shape = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(modes));
  std::vector<Candidate> all{{rough, mean_shape}};
  for (Eigen::Index axis = 0; axis < 6; ++axis)
    for (const double sign : {-1.0, 1.0}) {
      Vector6 motion = Vector6::Zero();
      motion(axis) = sign * 0.7 * (axis < 3 ? settings.rough_turn_deg / degrees : settings.rough_shift);
      all.push_back({motion_about(centre, 1, motion) * rough, mean_shape});
    }
  return all;
}

template <typename... Values>
std::string format(const char* pattern, Values... values) {
  std::array<char, 400> text{};
  std::snprintf(text.data(), text.size(), pattern, values...);
  return text.data();
}

class Registrar {
 public:
  Registrar(const ReferenceSurface& surface, std::span<const Point> points, const RigidTransform& rough,
            const RegistrationSettings& settings)
      : surface_(surface), settings_(settings), rough_(to_isometry(rough)), cloud_(finite(points), settings.points) {
    if (cloud_.size() < least_points)
      throw Error(Status::bad_input, "the clouds have " + std::to_string(cloud_.size()) +
                                         " points; registration needs at least " + std::to_string(least_points));
  }

  Registration run() {
    std::vector<Candidate> coarse = starts(rough_, rough_ * cloud_.middle(), surface_.modes.size(), settings_);
    see_from(coarse);
    const std::size_t every = std::max<std::size_t>(1, cloud_.chosen().size() / settings_.coarse_points);
    const double reach = settings_.rough_shift, fine = std::max(5 * settings_.noise, 0.05 * settings_.tolerance);
    for (Candidate& candidate : coarse) align_rigidly(candidate, std::array{reach, reach / 3, reach / 10}, every);
    rank(coarse);
    std::vector<Candidate> refined = distinct(coarse);
    see_from({refined.front()});
    for (Candidate& candidate : refined) {
      align_rigidly(candidate, std::array{reach / 10}, 1);
      align_with_shape(candidate, std::array{reach / 10, std::sqrt(reach / 10 * fine), fine});
    }
    rank(refined);
    return report(refined, coarse);
  }

 private:
  void see_from(const std::vector<Candidate>& viewpoints);
  [[nodiscard]] AlignmentTarget target(const Eigen::VectorXd& shape) const;
  void align_rigidly(Candidate& candidate, std::span<const double> scales, std::size_t every) const;
  void align_with_shape(Candidate& candidate, std::span<const double> scales) const;
  static void rank(std::vector<Candidate>& candidates) {
    std::ranges::stable_sort(candidates, {}, [](const Candidate& c) { return c.equations.cost; });
  }
  [[nodiscard]] std::vector<Candidate> distinct(const std::vector<Candidate>& ranked) const;
  [[nodiscard]] double apart(const Candidate& a, const Candidate& b) const;
  [[nodiscard]] Eigen::VectorXd prior(const AlignmentEquations& equations) const;
  [[nodiscard]] LeastCertain least_certain(const Candidate& best) const;
  [[nodiscard]] std::string doubt(const std::vector<Candidate>& refined, const LeastCertain& least) const;
  [[nodiscard]] Registration report(const std::vector<Candidate>& refined, const std::vector<Candidate>& coarse) const;

  const ReferenceSurface& surface_;
  const RegistrationSettings& settings_;
  Eigen::Isometry3d rough_;
  AlignmentCloud cloud_;
  std::vector<std::uint8_t> seen_;  // per element; empty: all
  double spacing_ = 0;              // of the cloud's points on the surface
};

// The elements seen from any of the poses, and the density of the points on them.
void Registrar::see_from(const std::vector<Candidate>& viewpoints) {
  const auto elements = surface_.elements;
  if (surface_.visible) {
    seen_.assign(elements.size(), 0);
    for (const Candidate& viewpoint : viewpoints) {
      const auto now = surface_.visible(to_transform(viewpoint.pose));
      for (std::size_t e = 0; e < seen_.size(); ++e) seen_[e] |= now[e];
    }
  }
  double area = 0;
  for (std::size_t e = 0; e < elements.size(); ++e) {
    const auto corner = [&](std::size_t k) {
      return Eigen::Map<const Eigen::Vector3f>(&surface_.positions[3 * std::size_t{elements[e][k]}]);
    };
    if (seen_.empty() || seen_[e] != 0)
      area += 0.5 * double{(corner(2) - corner(0)).cross(corner(3) - corner(1)).norm()};
  }
  if (!(area > 0))
    throw Error(Status::bad_input,
                surface_.visible
                    ? "from the rough pose the rig sees nothing of the reference mesh; check T_reference_sensor"
                    : "the reference mesh has no surface");
  spacing_ = std::sqrt(area / static_cast<double>(cloud_.size()));
}

AlignmentTarget Registrar::target(const Eigen::VectorXd& shape) const {
  std::vector<float> positions(surface_.positions.begin(), surface_.positions.end());
  for (std::size_t m = 0; m < surface_.modes.size(); ++m)
    for (std::size_t i = 0; i < positions.size(); ++i)
      positions[i] += static_cast<float>(shape(static_cast<Eigen::Index>(m))) * surface_.modes[m][i];
  const double step = std::sqrt(spacing_ * std::max(spacing_, 0.01 * cloud_.arm()));
  return {positions, surface_.elements, seen_, step};
}

void Registrar::align_rigidly(Candidate& candidate, std::span<const double> scales, std::size_t every) const {
  const AlignmentTarget at = target(candidate.shape);
  for (const double scale : scales) candidate.pose = align(at, cloud_, candidate.pose, {scale, spacing_, every});
  candidate.equations =
      alignment_equations(at, cloud_, candidate.pose, surface_.modes, {scales.back(), spacing_, every});
}

// Shapes are normally distributed with standard deviation 1, beside residuals that are only partly independent.
Eigen::VectorXd Registrar::prior(const AlignmentEquations& equations) const {
  Eigen::VectorXd precision = Eigen::VectorXd::Zero(equations.right.size());
  const double variance = std::pow(std::max(equations.residual(), settings_.noise), 2);
  precision.tail(precision.size() - 6).setConstant(variance * std::max(equations.weights / independent_residuals, 1.0));
  return precision;
}

void Registrar::align_with_shape(Candidate& candidate, std::span<const double> scales) const {
  const double arm = cloud_.arm();
  for (const double scale : scales)
    for (int round = 0; round < shape_rounds; ++round) {
      candidate.equations =
          alignment_equations(target(candidate.shape), cloud_, candidate.pose, surface_.modes, {scale, spacing_, 1});
      const Eigen::VectorXd precision = prior(candidate.equations);
      AlignmentEquations pulled = candidate.equations;
      pulled.right.tail(candidate.shape.size()) -= precision.tail(candidate.shape.size()).cwiseProduct(candidate.shape);
      const Eigen::VectorXd step = solve_damped(pulled, precision);
      if (!step.allFinite()) break;
      candidate.pose = motion_about(candidate.pose * cloud_.middle(), arm, step.head<6>()) * candidate.pose;
      candidate.shape += step.tail(candidate.shape.size());
      if (step.head<6>().norm() < 1e-3 * scale && step.tail(candidate.shape.size()).norm() < 1e-3) break;
    }
  candidate.equations = alignment_equations(target(candidate.shape), cloud_, candidate.pose, surface_.modes,
                                            {scales.back(), spacing_, 1});
}

double Registrar::apart(const Candidate& a, const Candidate& b) const {
  double squares = 0;
  for (const auto& p : cloud_.chosen()) squares += (a.pose * p - b.pose * p).squaredNorm();
  return std::sqrt(squares / static_cast<double>(cloud_.chosen().size()));
}

std::vector<Candidate> Registrar::distinct(const std::vector<Candidate>& ranked) const {
  std::vector<Candidate> chosen;
  for (const Candidate& candidate : ranked)
    if (chosen.size() < finalists && std::ranges::all_of(chosen, [&](const Candidate& other) {
          return apart(candidate, other) > settings_.tolerance;
        }))
      chosen.push_back(candidate);
  return chosen;
}

// Information on the pose when the shape is not known: the Schur complement of the shape's part.
LeastCertain Registrar::least_certain(const Candidate& best) const {
  Eigen::MatrixXd normal = best.equations.normal;
  normal.diagonal() += prior(best.equations);
  Matrix6 pose = normal.topLeftCorner<6, 6>();
  if (const auto modes = normal.rows() - 6; modes > 0)
    pose -= normal.topRightCorner(6, modes) *
            normal.bottomRightCorner(modes, modes).ldlt().solve(normal.bottomLeftCorner(modes, 6));
  const Eigen::SelfAdjointEigenSolver<Matrix6> solver(pose / std::max(best.equations.weights, 1e-12));
  const Vector6 motion = solver.eigenvectors().col(0);
  LeastCertain least;
  for (std::size_t i = 0; i < 3; ++i) {
    least.turn[i] = motion(static_cast<Eigen::Index>(i)) / cloud_.arm();
    least.shift[i] = motion(static_cast<Eigen::Index>(i + 3));
  }
  least.sensitivity = std::sqrt(std::max(solver.eigenvalues()(0), 0.0));
  least.deviation = std::max(best.equations.residual(), settings_.noise) /
                    (std::sqrt(independent_residuals) * std::max(least.sensitivity, 1e-12));
  return least;
}

std::string Registrar::doubt(const std::vector<Candidate>& refined, const LeastCertain& least) const {
  if (least.deviation > settings_.tolerance)
    return format(
        "the clouds hardly tell a shift along (%.2f, %.2f, %.2f) with a turn about (%.4f, %.4f, %.4f) rad per unit: it "
        "changes the distances by a share of %.3f only, and stays uncertain by %.2g",
        least.shift[0], least.shift[1], least.shift[2], least.turn[0], least.turn[1], least.turn[2], least.sensitivity,
        least.deviation);
  const Candidate& best = refined.front();
  for (std::size_t i = 1; i < refined.size(); ++i) {
    const double away = apart(refined[i], best);
    if (away > settings_.tolerance &&
        refined[i].equations.cost < 1.5 * best.equations.cost + settings_.noise * settings_.noise)
      return format("another pose, %.2g away, explains the clouds as well (residuals %.3g and %.3g)", away,
                    best.equations.residual(), refined[i].equations.residual());
  }
  return "";
}

Registration Registrar::report(const std::vector<Candidate>& refined, const std::vector<Candidate>& coarse) const {
  const Candidate& best = refined.front();
  if (best.equations.counted < least_points)
    throw Error(Status::bad_input, "after alignment only " + std::to_string(best.equations.counted) + " of " +
                                       std::to_string(best.equations.asked) +
                                       " points lie near the reference mesh; is this a frame of the undeformed "
                                       "component, and the rough pose within " +
                                       format("%g and %g degrees?", settings_.rough_shift, settings_.rough_turn_deg));
  Registration result;
  result.T_reference_sensor = to_transform(best.pose);
  result.residual = best.equations.residual();
  result.counted = static_cast<double>(best.equations.counted) / static_cast<double>(best.equations.asked);
  result.shift = (best.pose * cloud_.middle() - rough_ * cloud_.middle()).norm();
  result.turn_deg = Eigen::AngleAxisd(best.pose.linear() * rough_.linear().transpose()).angle() * degrees;
  result.shape.assign(best.shape.begin(), best.shape.end());
  const auto same = std::ranges::count_if(
      coarse, [&](const Candidate& end) { return apart(end, coarse.front()) <= 2 * settings_.tolerance; });
  result.agreeing = static_cast<double>(same) / static_cast<double>(coarse.size());
  result.least_certain = least_certain(best);
  result.doubt = doubt(refined, result.least_certain);
  return result;
}
}  // namespace

Registration register_cloud(const ReferenceSurface& surface, std::span<const Point> points, const RigidTransform& rough,
                            const RegistrationSettings& settings) {
  return Registrar(surface, points, rough, settings).run();
}
}  // namespace lbea::bake
