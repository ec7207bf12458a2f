#include "precompute/registration/alignment.hpp"

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

namespace lbea::bake {
namespace {

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

}  // namespace

AlignmentTarget::AlignmentTarget(std::span<const float> positions,
                                 std::span<const std::array<std::uint32_t, 4>> elements,
                                 std::span<const std::uint8_t> kept, double step)
    : surface_(positions, elements, kept) {
  const std::vector<std::uint32_t> place =
      first_at_place(positions);  // parts that meet without sharing nodes do not end there
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

}  // namespace lbea::bake
