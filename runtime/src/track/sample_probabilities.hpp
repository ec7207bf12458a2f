// The probability of each sample, given all frames of a test.
#pragma once

#include <lbea/lbea.hpp>

#include <vector>

namespace lbea {
/// The probabilities of one simulation that had a candidate, or the common ones of several that had none.
struct ProbabilityBlock {
  std::uint32_t first;  // sample of the simulation, or of one of them
  std::span<double> values;
  double simulations;  // number of them
  bool is_shared;
};

/// Simulations of which no sample was a candidate so far differ only by their time steps: those with the same steps
/// share their probabilities. So the time of a frame depends on the number of the others, not of all.
class SampleProbabilities {
 public:
  /// Allocates all memory.
  explicit SampleProbabilities(const Model& model);
  /// All samples are equally likely, and no simulation had a candidate.
  void reset() noexcept;
  /// The simulation has a candidate, and its own probabilities from now on.
  void separate(std::uint32_t simulation) noexcept;
  [[nodiscard]] std::uint32_t first(std::uint32_t simulation) const noexcept { return first_[simulation]; }

  /// Calls work(block) for each block.
  template <class Work>
  void for_each(const Work& work) noexcept {
    for (const Kind& kind : kinds_)
      if (kind.sharing > 0) work(block(kind));
    for (const std::uint32_t simulation : separate_) work(block(simulation));
  }
  /// Divides all by their sum.
  void normalize() noexcept;
  /// Per simulation, the sum of its samples' probabilities.
  void add_up(std::span<float> simulations) noexcept;
  /// The likeliest sample and its probability; ties go to the lower index.
  [[nodiscard]] std::pair<std::uint32_t, double> likeliest() noexcept;

 private:
  static constexpr std::size_t most_kinds = 64;  // further simulations with other steps share with none
  struct Kind {                                  // of simulations with the same time steps
    std::uint32_t first_simulation, first_sharing;
    std::size_t begin;    // in shared_
    double all, sharing;  // numbers of simulations
    float sum;            // of the probabilities
  };
  [[nodiscard]] std::size_t kind_of(const Model& model, std::uint32_t simulation) const;
  [[nodiscard]] std::size_t steps(std::uint32_t simulation) const noexcept {
    return first_[simulation + 1] - first_[simulation];
  }
  [[nodiscard]] ProbabilityBlock block(const Kind& kind) noexcept {
    return {first_[kind.first_sharing], std::span(shared_).subspan(kind.begin, steps(kind.first_simulation)),
            kind.sharing, true};
  }
  [[nodiscard]] ProbabilityBlock block(std::uint32_t simulation) noexcept {
    return {first_[simulation], std::span(own_).subspan(first_[simulation], steps(simulation)), 1, false};
  }

  std::vector<std::uint32_t> first_;  // per simulation: its first sample
  std::vector<std::uint32_t> kind_;   // per simulation
  std::vector<Kind> kinds_;
  std::vector<double> shared_;  // kind by kind
  std::vector<double> own_;     // per sample; of separate simulations
  std::vector<bool> is_separate_;
  std::vector<std::uint32_t> separate_;
};
}  // namespace lbea
