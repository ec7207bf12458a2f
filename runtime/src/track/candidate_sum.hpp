// What the candidates of several components say together about one frame.
#pragma once

#include "runtime/src/track/tracker.hpp"

#include <vector>

namespace lbea {

/// Logarithms of likelihoods, added up per sample. A sample that is no candidate of a component is as likely for it as
/// its worst one.
class CandidateSum {
 public:
  /// Allocates all memory.
  explicit CandidateSum(std::size_t samples) : gain_(samples), is_candidate_(samples) { candidates_.reserve(samples); }
  void clear() noexcept;
  /// Of one component. worst: the distance of its worst candidate.
  void add(const Model& model, std::span<const Match> candidates, const Likelihood& likelihood_of,
           float worst) noexcept;
  [[nodiscard]] bool empty() const noexcept { return candidates_.empty(); }
  /// The likeliest sample of all candidates; ties go to the lower index.
  [[nodiscard]] std::uint32_t best() const noexcept;
  /// Its probability among all candidates.
  [[nodiscard]] double share(std::uint32_t sample) const noexcept;

 private:
  std::vector<double> gain_;  // per sample, over one that is no candidate
  std::vector<bool> is_candidate_;
  std::vector<std::uint32_t> candidates_;
};

}  // namespace lbea
