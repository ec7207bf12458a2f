// The search of the ensemble: eq. 3 (LBEA) and eq. 1 (VtP), exact, the best k in ascending order.
#pragma once

#include "runtime/src/match/positions.hpp"
#include "runtime/src/model/model_view.hpp"

#include <cstdint>
#include <limits>
#include <span>
#include <vector>

namespace lbea {

struct RankedSample {
  std::uint32_t sample = 0;
  float distance = 0;
};

/// The k least distances offered so far, in any order; ties go to the lower index. What no float can hold is the
/// farthest.
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

/// Eq. 3: sum over modes j of |e_j - s_j|.
void search_lbea(const ReferenceView& reference, const Positions& coefficients, BestSamples& best) noexcept;

/// Eq. 1 over n: mean over vertices i of |e_i - s_i|.
void search_vtp(const ModelView& model, const ReferenceView& reference, const Positions& corresponding,
                BestSamples& best) noexcept;

}  // namespace lbea
