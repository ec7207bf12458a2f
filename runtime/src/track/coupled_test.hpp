// One test of one or several components, each with its own model: the hidden Markov model of lbea/tracker.hpp, in which
// the likelihoods of all components multiply.
#pragma once

#include "runtime/src/track/candidate_sum.hpp"
#include "runtime/src/track/component_of_test.hpp"
#include "runtime/src/track/sample_probabilities.hpp"

namespace lbea {

class CoupledTest {
 public:
  /// `config` must be valid. `components`: at least one, with the same runs; they are moved from.
  CoupledTest(std::span<TrackedComponent> components, const TrackerConfig& config);
  /// results: one per component; those that are absent are as refused ones.
  void update(std::span<const MatchResult> results) noexcept;
  void reset() noexcept;
  [[nodiscard]] const TestState& state(std::size_t component) const noexcept { return components_[component].state; }
  [[nodiscard]] std::size_t components() const noexcept { return components_.size(); }

 private:
  [[nodiscard]] const Model& model() const noexcept { return components_.front().model; }
  [[nodiscard]] const TrackerConfig& config() const noexcept { return components_.front().config; }
  [[nodiscard]] bool is_initial(Sample sample) const noexcept {
    return model().sample_index(sample) == probabilities_.first(sample.simulation);
  }
  void weigh_frame() noexcept;
  [[nodiscard]] Sample best() noexcept;
  [[nodiscard]] bool is_at_rest(Sample best) noexcept;
  void predict() noexcept;
  void separate(std::span<const Match> evidence) noexcept;
  void weigh(const ComponentOfTest& component) noexcept;
  void add_at_rest(ComponentOfTest& component) noexcept;
  void weigh_at_rest() noexcept;
  void publish() noexcept;
  void choose(std::span<const MatchResult> results) noexcept;
  void choose_of(const ComponentOfTest& component) noexcept;
  void choose_of_all() noexcept;
  void name(Sample sample, double probability) noexcept;
  void judge(ComponentOfTest& component, const SurfaceFit& fit) noexcept;
  [[nodiscard]] static double excess_of_named(const ComponentOfTest& c, const SurfaceFit& fit) noexcept;
  void conclude(ComponentOfTest& component) const noexcept;

  std::vector<ComponentOfTest> components_;
  SampleProbabilities probabilities_;
  std::vector<double> likelihood_;  // per sample, of simulations with their own probabilities
  CandidateSum sum_;
  int later_frames_ = 0;  // since the last one at rest
};

}  // namespace lbea
