// One shape for the frames of several rigs: the least squares of SurfaceFitter with the sum of the rigs' squares.
#pragma once

#include "runtime/src/fit/surface_fit.hpp"
#include "runtime/src/model/run_samples.hpp"

#include <lbea/rigs.hpp>

namespace lbea {

/// What a rig shows of a capture: its frame, fitted alone.
struct RigEvidence {
  SurfaceFitter* fitter = nullptr;
  const CloudIndex* index = nullptr;  // of the points
  double later_s = 0;                 // than the time that the joint shape is estimated for
};

class JointFitter {
 public:
  /// images: the first rig's, for the regression, the prices and the mesh noise. Allocates all memory.
  JointFitter(const ModelView& model, const DepthImages& images, std::size_t rigs, std::uint32_t max_matches,
              const FitSettings& settings = {});

  /// rigs: at least one, each with a fitted frame; must remain. expected: by the earlier captures. The spans of the
  /// result and of matches() are valid until the next call or the next frame of a rig. Does not allocate.
  SurfaceFit fit(std::span<const RigEvidence> rigs, const FrameExpectation* expected) noexcept;

  /// After fit(): corrects the estimate by the points of all rigs' frames, and ranks the candidates by it. Spread,
  /// time, bound and verdict remain those of the uncorrected estimate, as with one rig. Does not allocate.
  void correct(SurfaceFit& result) noexcept;
  /// The first step of it: compares the estimate with the points of each rig's frame. Does not allocate.
  void begin_correction() noexcept;

  /// The best sample at the time of the frame of a rig, by its place in the evidence.
  [[nodiscard]] std::uint32_t best_for(std::size_t rig) const noexcept {
    return simulations_.nearest_later(best_.ranked()[0].sample, rigs_[rig].later_s);
  }
  /// The motion that the frame of a rig, by its place in the evidence, lacks, given the prior and the frames of all
  /// rigs. Threads with different rigs may call it at the same time. Does not allocate.
  [[nodiscard]] const PoseBelief& pose_of(std::size_t rig, const PoseBelief& prior) noexcept;

  /// After all others: by how much the frame of a rig is later than the evidence says, s, by the combination of the
  /// candidates at other times. Not a number if it is half a step or more, or the times look alike. As pose_of().
  [[nodiscard]] double lag_of(std::size_t rig, double step_s) noexcept;

  /// fit() and correct() give each of these threads the work of some rigs.
  void use(const RigThreads& threads) noexcept { threads_ = threads; }
  /// Calls part(i) for each i < parts, on these threads.
  template <class Part>
  void side_by_side(std::size_t parts, const Part& part) const noexcept {
    const auto call = [](const void* work, std::size_t i) { (*static_cast<const Part*>(work))(i); };
    if (threads_.run != nullptr && parts > 1) return threads_.run(threads_.threads, parts, call, &part);
    for (std::size_t i = 0; i < parts; ++i) part(i);
  }

  /// As those of SurfaceFitter.
  [[nodiscard]] std::span<const RankedSample> matches() const noexcept { return weights_.matches(); }
  [[nodiscard]] Verdict verdict() const noexcept { return verdict_; }
  [[nodiscard]] bool is_explained() const noexcept {
    return verdict_ == Verdict::matched || verdict_ == Verdict::ambiguous;
  }
  [[nodiscard]] bool is_hidden() const noexcept { return is_hidden_; }
  /// Whether what explains all frames explains one rig's much worse than its own best sample does.
  [[nodiscard]] bool is_contradictory() const noexcept { return is_contradictory_; }
  [[nodiscard]] const ShapeEstimate& estimate() const noexcept { return estimate_; }
  [[nodiscard]] TimeBelief time() const noexcept { return {estimate_.time_s(), weights_.time_variance()}; }

 private:
  void propose() noexcept;
  void rank(const FrameExpectation* expected) noexcept;
  [[nodiscard]] SquareSums squares_of(SurfaceFitter& fitter, std::uint32_t sample) const noexcept;
  [[nodiscard]] float not_residual(std::uint32_t best) noexcept;
  void set_candidates() noexcept;
  void compare() noexcept;
  [[nodiscard]] std::span<const float> compare_at(std::size_t rig, double later_s) noexcept;
  [[nodiscard]] bool predicts(const RigEvidence& rig) const noexcept;
  [[nodiscard]] ShapePrediction predict() noexcept;
  void add_earlier(const RigEvidence& rig, float weight) noexcept;
  void judge(SurfaceFit& result) noexcept;
  [[nodiscard]] EstimateProblem problem() const noexcept;

  RigThreads threads_;
  const ModelView& model_;
  ShapeRegression regression_;
  FitSettings settings_;
  float noise_;  // squared length unit
  SimulationStates simulations_;
  std::span<const RigEvidence> rigs_;
  bool is_hidden_ = false;  // of every rig
  bool is_contradictory_ = false;
  std::vector<RankedSample> proposed_;
  std::size_t proposed_count_ = 0, compared_count_ = 0;
  std::vector<std::uint32_t> proposed_in_;  // per sample: the last fit that it was proposed in
  std::uint32_t fits_ = 0;
  BestSamples promising_;  // of a rig's proposals
  ExpectationCosts costs_;
  std::vector<RankedSample> compared_;
  std::vector<SquareSums> squares_;  // per rig, of those in compared_
  std::vector<float> depth_costs_;   // of those in compared_
  BestSamples best_;                 // distance: mean square, length unit squared, and the price of costs
  float price_per_cost_ = 0;
  std::vector<Match> candidates_;
  std::vector<float> alone_;  // per candidate: residual without the cost
  std::size_t states_of_rig_;
  std::vector<StateBetween> states_;  // per rig
  std::vector<RankedSample> of_rig_;  // per rig, the candidates at the time of its frame
  // rig_gram_: per rig, squared depth steps; pose_gram_: of the best candidates
  std::vector<float> gram_, rig_gram_, pose_gram_;
  float cells_ = 0;  // that its means are over
  ShapeEstimate estimate_;
  std::array<float, ShapeRegression::shape_scores> scores_{};  // predicted
  CandidateWeights weights_;
  Verdict verdict_ = Verdict::unknown;
};

}  // namespace lbea
