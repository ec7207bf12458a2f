#include "precompute/basis/vertex_tree.hpp"

#include "runtime/src/model/vertex_tree.hpp"

#include <algorithm>
#include <numeric>

namespace lbea::bake {
namespace {

class Builder {
 public:
  Builder(std::span<const float> positions, BakedTree& tree) : positions_(positions), tree_(tree) {}

  void build(std::uint32_t first, std::uint32_t count) {
    const std::size_t node = tree_.ranges.size();
    tree_.boxes.push_back(box_of(first, count));
    tree_.ranges.push_back({first, count, 0});
    const auto begin = tree_.order.begin() + first, end = begin + count;
    if (count <= vertex_tree_leaf) {
      std::sort(begin, end);
      return;
    }
    const std::uint32_t left = count / 2;
    const std::size_t axis = longest_side(tree_.boxes[node]);
    std::nth_element(begin, begin + left, end, [&](std::uint32_t a, std::uint32_t b) {
      const float at_a = positions_[3 * std::size_t{a} + axis], at_b = positions_[3 * std::size_t{b} + axis];
      return at_a != at_b ? at_a < at_b : a < b;
    });
    build(first, left);
    tree_.ranges[node][2] = static_cast<std::uint32_t>(tree_.ranges.size());
    build(first + left, count - left);
  }

 private:
  [[nodiscard]] std::array<float, 6> box_of(std::uint32_t first, std::uint32_t count) const {
    constexpr float infinity = std::numeric_limits<float>::infinity();
    std::array<float, 6> box{infinity, infinity, infinity, -infinity, -infinity, -infinity};
    for (std::uint32_t i = first; i < first + count; ++i)
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const float x = positions_[3 * std::size_t{tree_.order[i]} + axis];
        box[axis] = std::min(box[axis], x);
        box[axis + 3] = std::max(box[axis + 3], x);
      }
    return box;
  }

  static std::size_t longest_side(const std::array<float, 6>& box) {
    const std::array<float, 3> sides{box[3] - box[0], box[4] - box[1], box[5] - box[2]};
    return static_cast<std::size_t>(std::max_element(sides.begin(), sides.end()) - sides.begin());
  }

  std::span<const float> positions_;
  BakedTree& tree_;
};

}  // namespace

BakedTree build_vertex_tree(std::span<const float> positions) {
  BakedTree tree;
  tree.order.resize(positions.size() / 3);
  std::iota(tree.order.begin(), tree.order.end(), 0u);
  if (!tree.order.empty()) Builder(positions, tree).build(0, static_cast<std::uint32_t>(tree.order.size()));
  return tree;
}

}  // namespace lbea::bake
