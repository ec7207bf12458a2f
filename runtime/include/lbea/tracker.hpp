// tracker.hpp - the whole test: evidence accumulated from frame to frame, never going back in time.
//
// A hidden Markov model over the samples. Between two frames the time step of a simulation stays or moves forward by
// any number of steps; fewer steps are more likely. Neither the rates of the two clocks nor their offset are needed. A
// small share of the probability may change to another simulation, so that the tracker recovers from a wrong start.
//
// With fit, the sample of a frame is chosen among its candidates: a simulation that explained the frames before less
// well than the best one ranks lower.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

struct TrackerConfig {
  float sharpness = 8;  // how fast plausibility decreases with the excess of the squared residual over the best one
  float noise = 0;      // length unit; differences of residuals below it are not significant; 0: 0.5 mm
  float persistence = 0.8f;  // probability of moving forward by one more step
  float change = 0.01f;      // share of the probability that may change to another simulation per frame
};

/// Spans are valid until the next update() or reset().
struct TestState {
  std::uint64_t frames = 0;  // frames with evidence
  Sample sample;             // that of the latest frame with the best rank; without ranks the most likely one now,
                             // given all frames so far
  float sample_probability = 0;
  std::uint32_t simulation = 0;                       // the most likely one for the whole test so far
  std::span<const float> simulation_probabilities{};  // simulations(), for the whole test so far
  std::span<const float> branch_probabilities{};      // branches()
  float misfit = 0;  // weighted geometric mean of the frames' misfits; frames with a small expected residual count
                     // most; 0: none so far
  Verdict verdict = Verdict::unknown;  // for the whole test so far; unknown during the first frames
};

/// One per test, for frames in their order. update() does not allocate, lock or throw; its cost is linear in the number
/// of simulations, and of samples of those that had a candidate.
class LBEA_API Tracker {
 public:
  /// Throws Error{bad_config} with the offending value.
  /// `views`: the matcher's; when empty, those baked into the model.
  explicit Tracker(Model model, const TrackerConfig& config = {}, SensorViews views = {});
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  /// Adds a matched frame, of any method; fit's candidates are the best evidence. Refused frames change nothing.
  const TestState& update(const MatchResult& result) noexcept;
  [[nodiscard]] const TestState& state() const noexcept;
  /// Starts another test with the next frame.
  void reset() noexcept;

 private:
  struct LBEA_HIDDEN State;
  std::unique_ptr<State> state_;
};

/// The candidates with their ranks as distances, if there are any: the evidence for likeliest_path().
[[nodiscard]] LBEA_API std::vector<Match> ranked(std::span<const Match> candidates, std::span<const float> ranks);

/// After the test: one sample per frame; of those with nearly the same rank, one whose simulation fits the frames
/// before and after. evidence: the candidates of each frame, of which those that are not in the model are ignored; a
/// frame without any repeats the sample before it, or has that of the first frame with candidates. For offline use.
[[nodiscard]] LBEA_API std::vector<Sample> likeliest_path(const Model& model,
                                                          std::span<const std::vector<Match>> evidence);

}  // namespace lbea
