// Eq. 3 is a metric: a ball that holds many samples rules all of them out at once. Exact, for many samples.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/match/nearest_samples.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

/// Whether a tree finds the best `wanted` of so many samples sooner than a look at each does.
[[nodiscard]] constexpr bool is_worth_a_tree(std::size_t samples, std::size_t wanted) noexcept {
  return samples >= 2048 && samples >= 32 * wanted;
}

class SampleTree {
 public:
  /// coefficients: s x 3 x padded(modes), which must outlive the tree. Some 50 ns per sample and level; its memory is
  /// that of one sample in sixteen.
  SampleTree(std::span<const float> coefficients, std::size_t modes);

  /// What search_lbea() finds, to the bit. `best`: on entry the answer of an earlier search, which bounds this one from
  /// the beginning when it is still near; the result does not depend on it. No allocation.
  void search(const Positions& coefficients, BestSamples& best) const noexcept;

 private:
  static constexpr std::uint32_t leaf_size = 32;
  struct Node {
    std::uint32_t begin, end;  // of its samples in order_
    std::uint32_t right;       // its second child, the first one follows it; 0: a leaf
    float radius;              // of the ball about its centre that holds them, by eq. 3
  };
  struct Search;

  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  void enclose(Node& node);
  [[nodiscard]] std::size_t widest(std::uint32_t begin, std::uint32_t end) const;
  [[nodiscard]] const float* sample(std::uint32_t s) const noexcept { return coefficients_.data() + 3 * stride_ * s; }
  [[nodiscard]] const float* centre(std::uint32_t node) const noexcept { return centres_.data() + 3 * stride_ * node; }
  void visit(Search& search, std::uint32_t node, float distance) const noexcept;
  void visit_leaf(Search& search, const Node& node, float distance) const noexcept;

  const Kernels& code_;
  std::span<const float> coefficients_;
  std::size_t stride_;
  std::vector<std::size_t> leading_;  // the coefficients that vary most: by them samples are divided
  std::vector<std::uint32_t> order_;  // samples, node by node
  std::vector<float> from_centre_;    // of each in that order: how far from its leaf's centre
  std::vector<Node> nodes_;
  std::vector<float> centres_;  // nodes x 3 x stride
};

}  // namespace lbea
