#include "precompute/registration/alignment.hpp"

#include <Eigen/Cholesky>
#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <map>

namespace lbea::bake {
namespace {
constexpr int most_steps = 30;
constexpr double still = 1e-5;    // of the scale: smaller steps end the iteration
constexpr double damping = 1e-6;  // of the mean: unobservable motions stay zero
constexpr double counted_scales = 3, reach_scales = 20, edge_reach_scales = 5;

Eigen::Vector3d node(std::span<const float> positions, std::uint32_t i) {
  const float* p = &positions[3 * std::size_t{i}];
  return {double{p[0]}, double{p[1]}, double{p[2]}};
}

/// Per node: the first node at the same place.
std::vector<std::uint32_t> first_at_place(std::span<const float> positions) {
  std::map<std::array<float, 3>, std::uint32_t> first;
  std::vector<std::uint32_t> result;
  for (std::uint32_t i = 0; i < positions.size() / 3; ++i) {
    const float* p = &positions[3 * std::size_t{i}];
    const bool finite = std::isfinite(p[0]) && std::isfinite(p[1]) && std::isfinite(p[2]);
    result.push_back(finite ? first.emplace(std::array{p[0], p[1], p[2]}, i).first->second : i);
  }
  return result;
}

struct Points {
  const std::vector<Eigen::Vector3d>& all;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return all.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const {
    return all[i](static_cast<Eigen::Index>(axis));
  }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

/// Sums the weighted rows of the Jacobian.
class EquationSum {
 public:
  EquationSum(AlignmentEquations& equations, std::span<const std::vector<float>> modes, double arm)
      : equations_(equations), modes_(modes), arm_(arm) {
    const auto size = static_cast<Eigen::Index>(6 + modes.size());
    equations.normal = Eigen::MatrixXd::Zero(size, size);
    equations.right = Eigen::VectorXd::Zero(size);
    row_.resize(size);
  }

  /// residual = direction . (point - foot); the foot moves with the shape by its nodes' shares.
  template <std::size_t n>
  void add(const Eigen::Vector3d& from_centre, const Eigen::Vector3d& direction,
           const std::array<std::uint32_t, n>& nodes, const std::array<double, n>& shares, double residual,
           double scale) {
    row_.head<3>() = from_centre.cross(direction) / arm_;
    row_.segment<3>(3) = direction;
    for (std::size_t m = 0; m < modes_.size(); ++m) {
      double along = 0;
      for (std::size_t k = 0; k < n; ++k)
        for (std::size_t axis = 0; axis < 3; ++axis)
          along += shares[k] * double{modes_[m][3 * std::size_t{nodes[k]} + axis]} *
                   direction(static_cast<Eigen::Index>(axis));
      row_(static_cast<Eigen::Index>(6 + m)) = -along;
    }
    const double share = scale * scale / (scale * scale + residual * residual), weight = share * share;
    equations_.normal.noalias() += weight * row_ * row_.transpose();
    equations_.right -= weight * residual * row_;
    equations_.weights += weight;
  }

 private:
  AlignmentEquations& equations_;
  std::span<const std::vector<float>> modes_;
  double arm_;
  Eigen::VectorXd row_;
};
}  // namespace

AlignmentTarget::AlignmentTarget(std::span<const float> positions,
                                 std::span<const std::array<std::uint32_t, 4>> elements,
                                 std::span<const std::uint8_t> kept, double step)
    : surface_(positions, elements, kept) {
  const std::vector<std::uint32_t> place = first_at_place(positions);  // parts may meet without sharing nodes
  struct Owner {
    int elements = 0;
    std::size_t element = 0;
    std::array<std::uint32_t, 2> nodes{};
  };
  std::map<std::pair<std::uint32_t, std::uint32_t>, Owner> owners;
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = elements[e][k], b = elements[e][(k + 1) % 4];
      if (a == b) continue;
      Owner& owner = owners[std::minmax(place[a], place[b])];
      owner = {owner.elements + 1, e, {a, b}};
    }
  for (const auto& [edge, owner] : owners) {
    if (owner.elements != 1 || (!kept.empty() && kept[owner.element] == 0)) continue;
    const Eigen::Vector3d a = node(positions, owner.nodes[0]), b = node(positions, owner.nodes[1]);
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const std::uint32_t corner : elements[owner.element]) centre += 0.25 * node(positions, corner);
    const Eigen::Vector3d along = (b - a).normalized();
    Eigen::Vector3d outward = 0.5 * (a + b) - centre;
    outward -= outward.dot(along) * along;
    if (!(outward.norm() > 0) || !(b - a).allFinite()) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil((b - a).norm() / step)));
    for (int i = 0; i < parts; ++i) {
      const double share = (i + 0.5) / parts;
      edges_.push_back({a + (b - a) * share, outward.normalized(), owner.nodes, {1 - share, share}});
    }
  }
}

struct AlignmentCloud::Tree {
  using Index =
      nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3, std::uint32_t>;
  explicit Tree(const std::vector<Eigen::Vector3d>& all)
      : points{all}, index(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}
  Points points;
  Index index;
};

AlignmentCloud::AlignmentCloud(std::vector<Eigen::Vector3d> all, std::size_t chosen)
    : all_(std::move(all)), middle_(Eigen::Vector3d::Zero()) {
  const std::size_t count = std::min(chosen, all_.size());
  for (std::size_t i = 0; i < count; ++i) chosen_.push_back(all_[i * all_.size() / count]);
  for (const auto& p : chosen_) middle_ += p / static_cast<double>(count);
  double squares = 0;
  for (const auto& p : chosen_) squares += (p - middle_).squaredNorm();
  arm_ = std::max(std::sqrt(squares / static_cast<double>(std::max<std::size_t>(count, 1))), 1e-9);
  tree_ = std::make_unique<const Tree>(all_);
}
AlignmentCloud::~AlignmentCloud() = default;

const Eigen::Vector3d& AlignmentCloud::nearest(const Eigen::Vector3d& to) const {
  std::uint32_t index = 0;
  double squared = 0;
  tree_->index.knnSearch(to.data(), 1, &index, &squared);
  return all_[index];
}

double AlignmentEquations::residual() const {
  return counted > 0 ? std::sqrt(squares / static_cast<double>(counted)) : 0;
}

// Points: r = distance from the surface; its gradient is the unit vector from the foot: the normal inside the surface,
// across the edge beyond it. Edges: r = how far the cloud goes beyond the edge, half a spacing short of it on average.
AlignmentEquations alignment_equations(const AlignmentTarget& target, const AlignmentCloud& cloud,
                                       const Eigen::Isometry3d& pose, std::span<const std::vector<float>> modes,
                                       const AlignmentSettings& settings) {
  AlignmentEquations equations;
  EquationSum sum(equations, modes, cloud.arm());
  const double scale = settings.scale;
  const Eigen::Vector3d centre = pose * cloud.middle();
  for (std::size_t i = 0; i < cloud.chosen().size(); i += settings.every) {
    ++equations.asked;
    const Eigen::Vector3d p = pose * cloud.chosen()[i];
    const SurfacePlace place = target.surface().nearest({p.x(), p.y(), p.z()}, reach_scales * scale);
    const double r2 = place.distance * place.distance;
    equations.cost += place.found() ? scale * scale * r2 / (scale * scale + r2) : scale * scale;
    if (place.found() && place.distance > 0)
      sum.add(p - centre, (p - Eigen::Vector3d(place.position.data())) / place.distance, place.nodes, place.shares,
              place.distance, scale);
    if (place.distance > counted_scales * scale) continue;
    ++equations.counted;
    equations.squares += r2;
  }
  equations.cost /= static_cast<double>(std::max<std::size_t>(equations.asked, 1));
  const double edge_scale = std::max(scale, 2 * settings.spacing);
  const Eigen::Isometry3d back = pose.inverse();
  for (const auto& edge : target.edges()) {
    const Eigen::Vector3d p = pose * cloud.nearest(back * edge.position);
    if ((p - edge.position).norm() > edge_reach_scales * edge_scale) continue;
    sum.add(p - centre, edge.outward, edge.nodes, edge.shares,
            (p - edge.position).dot(edge.outward) + 0.5 * settings.spacing, edge_scale);
  }
  return equations;
}

Eigen::VectorXd solve_damped(const AlignmentEquations& equations, const Eigen::VectorXd& prior) {
  Eigen::MatrixXd normal = equations.normal;
  normal.diagonal() += prior;
  normal.diagonal().array() += damping * std::max(normal.trace() / static_cast<double>(normal.rows()), 1e-12);
  return normal.ldlt().solve(equations.right);
}

Eigen::Isometry3d align(const AlignmentTarget& target, const AlignmentCloud& cloud, const Eigen::Isometry3d& start,
                        const AlignmentSettings& settings) {
  Eigen::Isometry3d pose = start;
  for (int step = 0; step < most_steps; ++step) {
    const Vector6 motion = solve_damped(alignment_equations(target, cloud, pose, {}, settings), Vector6::Zero());
    if (!motion.allFinite()) break;
    pose = motion_about(pose * cloud.middle(), cloud.arm(), motion) * pose;
    if (motion.norm() < still * settings.scale) break;
  }
  return pose;
}
}  // namespace lbea::bake
