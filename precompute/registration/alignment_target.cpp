#include "precompute/registration/alignment.hpp"

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace lbea {

namespace {

Eigen::Vector3d node(std::span<const float> positions, std::uint32_t i) {
  const float* p = &positions[3 * std::size_t{i}];
  return {double{p[0]}, double{p[1]}, double{p[2]}};
}

struct Points {
  const std::vector<Eigen::Vector3d>& all;
  [[nodiscard]] std::size_t kdtree_get_point_count() const { return all.size(); }
  [[nodiscard]] double kdtree_get_pt(std::size_t i, std::size_t axis) const { return all[i](static_cast<Eigen::Index>(axis)); }
  template <class Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

}  // namespace

AlignmentTarget::AlignmentTarget(std::span<const float> positions, std::span<const std::array<std::uint32_t, 4>> elements,
                                 std::span<const std::uint8_t> kept, double step)
    : surface_(positions, elements, kept) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::pair<int, std::size_t>> owners;  // how many elements share the edge, and one of them
  for (std::size_t e = 0; e < elements.size(); ++e)
    for (std::size_t k = 0; k < 4; ++k) {
      const std::uint32_t a = elements[e][k], b = elements[e][(k + 1) % 4];
      if (a == b) continue;
      auto& owner = owners[std::minmax(a, b)];
      ++owner.first;
      owner.second = e;
    }
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
    for (int i = 0; i < parts; ++i) {
      const double share = (i + 0.5) / parts;
      edges_.push_back({a + (b - a) * share, outward.normalized(), {edge.first, edge.second}, {1 - share, share}});
    }
  }
}

struct AlignmentCloud::Tree {
  using Index = nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<double, Points>, Points, 3, std::uint32_t>;
  explicit Tree(const std::vector<Eigen::Vector3d>& all) : points{all}, index(3, points, nanoflann::KDTreeSingleIndexAdaptorParams(10)) {}
  Points points;
  Index index;
};

AlignmentCloud::AlignmentCloud(std::vector<Eigen::Vector3d> all, std::size_t chosen) : all_(std::move(all)), middle_(Eigen::Vector3d::Zero()) {
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

}  // namespace lbea
