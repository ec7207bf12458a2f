#include "precompute/registration/alignment.hpp"

#include <Eigen/Cholesky>
#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace lbea {

namespace {

constexpr int most_steps = 30;          // per scale
constexpr double still = 1e-5;          // of the scale: a step below it ends the scale
constexpr double damping = 1e-6;        // of the mean: motions that nothing tells stay where they are
constexpr double counted_scales = 3;

struct Points {
  const std::vector<Eigen::Vector3d>& all;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return all.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const { return all[i](static_cast<Eigen::Index>(axis)); }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

Eigen::Vector3d node(std::span<const float> positions, std::uint32_t i) {
  const float* p = &positions[3 * std::size_t{i}];
  return {double{p[0]}, double{p[1]}, double{p[2]}};
}

using Edge = std::pair<std::uint32_t, std::uint32_t>;

}  // namespace

std::vector<EdgePlace> free_edges(std::span<const float> positions, std::span<const std::array<std::uint32_t, 4>> elements,
                                  std::span<const std::uint8_t> kept, double step) {
  std::map<Edge, std::pair<int, std::size_t>> owners;  // how many elements share the edge, and one of them
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = elements[e][k], b = elements[e][(k + 1) % 4];
      if (a == b) continue;
      auto& owner = owners[std::minmax(a, b)];
      ++owner.first;
      owner.second = e;
    }
  std::vector<EdgePlace> places;
  for (const auto& [edge, owner] : owners) {
    if (owner.first != 1 || (!kept.empty() && kept[owner.second] == 0)) continue;
    const Eigen::Vector3d a = node(positions, edge.first), b = node(positions, edge.second);
    Eigen::Vector3d centre = Eigen::Vector3d::Zero();
    for (const std::uint32_t corner : elements[owner.second]) centre += 0.25 * node(positions, corner);
    const Eigen::Vector3d along = (b - a).normalized();
    Eigen::Vector3d outward = 0.5 * (a + b) - centre;
    outward -= outward.dot(along) * along;
    if (!(outward.norm() > 0) || !(b - a).allFinite()) continue;
    const int parts = std::max(1, static_cast<int>(std::ceil((b - a).norm() / step)));
    for (int i = 0; i < parts; ++i) places.push_back({a + (b - a) * ((i + 0.5) / parts), outward.normalized()});
  }
  return places;
}

struct Alignment::CloudTree {
  using Tree = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3, std::uint32_t>;
  explicit CloudTree(const std::vector<Eigen::Vector3d>& all) : points{all}, tree(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}
  Points points;
  Tree tree;
};

struct Alignment::Equations {
  Matrix6 normal = Matrix6::Zero();
  Vector6 right = Vector6::Zero();
  double cost = 0, squares = 0, weights = 0;
  std::size_t counted = 0;

  void add(const Eigen::Vector3d& arm, double arm_length, const Eigen::Vector3d& direction, double residual, double scale) {
    const double share = scale * scale / (scale * scale + residual * residual), weight = share * share;
    Vector6 row;
    row << arm.cross(direction) / arm_length, direction;
    normal += weight * row * row.transpose();
    right -= weight * residual * row;
    weights += weight;
  }
};

Alignment::Alignment(const SurfaceTree& surface, std::vector<EdgePlace> edges, std::vector<Eigen::Vector3d> points, double spacing)
    : surface_(surface), edges_(std::move(edges)), points_(std::move(points)), spacing_(spacing), middle_(Eigen::Vector3d::Zero()) {
  for (const auto& p : points_) middle_ += p / static_cast<double>(points_.size());
  double squares = 0;
  for (const auto& p : points_) squares += (p - middle_).squaredNorm();
  arm_ = std::max(std::sqrt(squares / static_cast<double>(std::max<std::size_t>(points_.size(), 1))), 1e-9);
  tree_ = std::make_unique<const CloudTree>(points_);
}
Alignment::~Alignment() = default;

// r = distance from the surface; its gradient is the unit vector from the foot: the normal inside the surface, across
// the edge beyond it.
Alignment::Equations Alignment::equations(const Eigen::Isometry3d& pose, double scale, std::size_t every) const {
  Equations equations;
  const Eigen::Vector3d centre = pose * middle_;
  std::size_t asked = 0;
  for (std::size_t i = 0; i < points_.size(); i += every) {
    ++asked;
    const Eigen::Vector3d p = pose * points_[i];
    const SurfacePlace place = surface_.nearest({p.x(), p.y(), p.z()}, 20 * scale);
    if (!place.found()) {
      equations.cost += scale * scale;
      continue;
    }
    const Eigen::Vector3d from(place.position.data()), to = p - from;
    const double r2 = to.squaredNorm();
    equations.cost += scale * scale * r2 / (scale * scale + r2);
    if (place.distance > 0) equations.add(p - centre, arm_, to / place.distance, place.distance, scale);
    if (place.distance > counted_scales * scale) continue;
    ++equations.counted;
    equations.squares += r2;
  }
  const double edge_scale = std::max(scale, 2 * spacing_);
  const Eigen::Isometry3d back = pose.inverse();
  for (const EdgePlace& edge : edges_) {
    const Eigen::Vector3d query = back * edge.position;
    std::uint32_t index = 0;
    double squared = 0;
    if (tree_->tree.knnSearch(query.data(), 1, &index, &squared) == 0 || squared > 25 * edge_scale * edge_scale) continue;
    const Eigen::Vector3d p = pose * points_[index];
    const double r = (p - edge.position).dot(edge.outward) + 0.5 * spacing_;
    equations.add(p - centre, arm_, edge.outward, r, edge_scale);
  }
  equations.cost /= static_cast<double>(std::max<std::size_t>(asked, 1));
  return equations;
}

AlignmentState Alignment::align(const Eigen::Isometry3d& start, std::span<const double> scales, std::size_t every) const {
  AlignmentState state{.pose = start};
  for (const double scale : scales)
    for (int step = 0; step < most_steps; ++step) {
      const Equations now = equations(state.pose, scale, every);
      Matrix6 normal = now.normal;
      normal.diagonal().array() += damping * std::max(normal.trace() / 6, 1e-12);
      const Vector6 motion = normal.ldlt().solve(now.right);
      if (!motion.allFinite()) break;
      state.pose = motion_about(state.pose * middle_, arm_, motion) * state.pose;
      if (motion.norm() < still * scale) break;
    }
  const Equations last = equations(state.pose, scales.back(), every);
  state.cost = last.cost;
  state.residual = last.counted > 0 ? std::sqrt(last.squares / static_cast<double>(last.counted)) : scales.back();
  state.counted = static_cast<double>(last.counted) / static_cast<double>((points_.size() + every - 1) / every);
  if (last.weights > 0) state.normal = last.normal / last.weights;
  return state;
}

}  // namespace lbea
