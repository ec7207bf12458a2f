// Method step 4: the exact search of the ensemble by eq. 1, sum over vertices i of |e_i - s_i|.
#pragma once

#include "runtime/src/match/sample_search.hpp"

namespace lbea {
/// Reads the positions of few samples. The vertices form groups, and a sum of lengths is at least the length of the
/// sum: |sum of e_i over a group - sum of s_i|, added over the groups, is a lower bound of eq. 1. It takes 3 floats per
/// group and sample, and excludes all but some tens of samples. For these, the lengths of one group after the other
/// replace the group's part of the bound until that excludes them, too.
class PositionSearch {
 public:
  /// model and reference must outlive it. Reads all samples' positions once. Allocates all memory.
  PositionSearch(const ModelView& model, const ReferenceView& reference, const Kernels& code = kernels());

  /// The best samples by their mean distance per vertex, the same as after calling distance() for every sample. Does
  /// not allocate.
  void search(const Positions& corresponding, BestSamples& best) noexcept;
  /// Eq. 1 over n: mean over vertices i of |e_i - s_i|.
  [[nodiscard]] float distance(const Positions& corresponding, std::uint32_t sample) const noexcept;

 private:
  static constexpr std::size_t lanes = 16;
  struct Lengths {  // sums over vertices, which differ by a multiple of `lanes`
    float of_lane[lanes]{};
    [[nodiscard]] float sum() const noexcept;
  };

  [[nodiscard]] const float* position(std::uint32_t sample, std::size_t vertex) const noexcept {
    return model_.node_positions.data() +
           3 * (std::size_t{model_.info.nodes} * sample + reference_.correspondence[n_ * sample + vertex]);
  }
  [[nodiscard]] const float* sums(std::uint32_t sample) const noexcept { return sums_.data() + 3 * stride_ * sample; }
  double add_up(const Positions& positions, std::span<float> sums) const noexcept;
  void add_lengths(const Positions& corresponding, std::uint32_t sample, std::size_t begin, std::size_t end,
                   Lengths& lengths) const noexcept;
  void bound_all(const Positions& corresponding) noexcept;
  /// No sample with a larger sum of lengths is among the best.
  [[nodiscard]] float limit(const BestSamples& best) const noexcept;
  /// By how much the lengths of a group exceed its part of the bound.
  [[nodiscard]] float excess(const Positions& corresponding, std::uint32_t sample, std::uint32_t group) const noexcept;
  [[nodiscard]] bool is_excluded(const Positions& corresponding, std::uint32_t sample,
                                 const BestSamples& best) const noexcept;
  void order_groups(const Positions& corresponding) noexcept;

  const ModelView& model_;
  const ReferenceView& reference_;
  const Kernels& code_;
  std::size_t n_, group_, groups_, stride_;  // vertices; of a group; groups; floats per plane of sums
  std::vector<float> sums_;                  // samples x 3 x stride: sums of displacements from the reference
  double largest_ = 0;                       // sum over a sample's displacements of |x| + |y| + |z|, greatest of all
  // Of the frame:
  std::vector<float> frame_sums_;     // 3 x stride
  std::vector<float> bounds_;         // of each sample, or infinity when it was offered
  std::vector<std::uint32_t> order_;  // of the groups, by their excess in the nearest samples: those that exclude most
  std::vector<float> excesses_;
  BestSamples nearest_;  // by their bounds
  float margin_ = 0;     // absolute error of a bound
};
}  // namespace lbea
