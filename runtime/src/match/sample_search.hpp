// Method step 5: coefficients in the eigenbasis, and the exact search of the ensemble by eq. 3.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/match/correspondence.hpp"
#include "runtime/src/model/model_view.hpp"

namespace lbea {
/// alpha = Psi' M f for f = x, y, z. `projection` is Psi' M: coefficients.count rows of padded(positions.count) floats.
void project(std::span<const float> projection, const Positions& positions, Positions& coefficients) noexcept;

struct RankedSample {
  std::uint32_t sample = 0;
  float distance = 0;
};
[[nodiscard]] inline bool is_before(const RankedSample& a, const RankedSample& b) noexcept {
  return a.distance < b.distance || (a.distance == b.distance && a.sample < b.sample);
}

/// The k least distances offered so far, ascending; ties go to the lower index. A distance that is not finite counts as
/// the largest float.
class BestSamples {
 public:
  explicit BestSamples(std::uint32_t capacity) : ranked_(capacity) {}
  void clear() noexcept { size_ = 0; }
  void offer(std::uint32_t sample, float distance) noexcept;
  /// Only a distance below this one can still enter.
  [[nodiscard]] float bound() const noexcept {
    return size_ < ranked_.size() ? std::numeric_limits<float>::infinity() : ranked_.back().distance;
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return ranked_.size(); }
  [[nodiscard]] std::span<const RankedSample> ranked() const noexcept { return std::span(ranked_).first(size_); }

 private:
  std::vector<RankedSample> ranked_;
  std::size_t size_ = 0;
};

/// Moves the `count` least distances to the front, in any order; ties go to the lower index.
void put_nearest_first(std::span<RankedSample> samples, std::size_t count) noexcept;

/// The same k samples without their order, which takes less time for hundreds of them.
class SelectedSamples {
 public:
  explicit SelectedSamples(std::uint32_t capacity) : capacity_(capacity), kept_(std::size_t{2} * capacity) {}
  void clear() noexcept { size_ = 0; }
  /// distance: finite.
  void offer(std::uint32_t sample, float distance) noexcept {
    if (size_ >= capacity_ && !is_before({sample, distance}, kept_[capacity_ - 1])) return;
    kept_[size_++] = {sample, distance};
    if (size_ == capacity_ || size_ == kept_.size()) select();
  }
  /// The best `first` of them are the first. To be cleared before further offers.
  [[nodiscard]] std::span<const RankedSample> selected(std::size_t first) noexcept;
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }

 private:
  /// Keeps the best ones; the farthest of them is the last one.
  void select() noexcept;

  std::size_t capacity_, size_ = 0;
  std::vector<RankedSample> kept_;  // from capacity_ on: since the last selection
};

/// Eq. 3: sum over modes j of |e_j - s_j|.
void search_lbea(const ReferenceView& reference, const Positions& coefficients, BestSamples& best) noexcept;

/// Whether a SampleTree finds the best `wanted` samples faster than search_lbea().
[[nodiscard]] constexpr bool is_worth_a_tree(std::size_t samples, std::size_t wanted) noexcept {
  return samples >= 2048 && samples >= 32 * wanted;
}

/// Exact search by eq. 3 among many samples: eq. 3 is a metric, so one distance can exclude a whole ball of samples.
class SampleTree {
 public:
  /// coefficients: s x 3 x padded(modes), which must outlive the tree. Takes about 50 ns per sample and level; the tree
  /// needs as much memory as one sample in sixteen.
  SampleTree(std::span<const float> coefficients, std::size_t modes);

  /// The same result as search_lbea(), bit by bit. On entry `best` may hold the result of an earlier search: it bounds
  /// this one but does not change its result. Does not allocate.
  void search(const Positions& coefficients, BestSamples& best) const noexcept;

 private:
  static constexpr std::uint32_t leaf_size = 32;
  struct Node {
    std::uint32_t begin, end;  // of its samples in order_
    std::uint32_t right;       // second child, the first one follows the node; 0: a leaf
    float radius;              // of the ball by eq. 3 about the node's center that holds its samples
  };
  struct Search;

  std::uint32_t build(std::uint32_t begin, std::uint32_t end);
  void enclose(Node& node);
  [[nodiscard]] std::size_t widest(std::uint32_t begin, std::uint32_t end) const;
  [[nodiscard]] const float* sample(std::uint32_t s) const noexcept { return coefficients_.data() + 3 * stride_ * s; }
  [[nodiscard]] const float* center(std::uint32_t node) const noexcept { return centers_.data() + 3 * stride_ * node; }
  void visit(Search& search, std::uint32_t node, float distance) const noexcept;
  void visit_leaf(Search& search, const Node& node, float distance) const noexcept;

  const Kernels& code_;
  std::span<const float> coefficients_;
  std::size_t stride_;
  std::vector<std::size_t> leading_;  // the coefficients that vary most, along which samples are divided
  std::vector<std::uint32_t> order_;  // samples, node by node
  std::vector<float> from_center_;    // in that order: distance of each sample from the center of its leaf
  std::vector<Node> nodes_;
  std::vector<float> centers_;  // nodes x 3 x stride
};
}  // namespace lbea
