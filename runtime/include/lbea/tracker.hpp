// tracker.hpp - what a whole test says: evidence added up from frame to frame, never going back in time.
//
// A hidden Markov model over the samples. Between two frames a simulation's time step stays or moves forward by any
// number of steps, the nearer the likelier: neither clock's rate nor their offset is needed. A small share of the
// probability may change to another simulation, so that a wrong start does not lock in.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

struct TrackerConfig {
  float sharpness = 8;       // how fast plausibility falls with a candidate's squared residual over the best one's
  float noise = 0.5f;        // length unit; residuals below it tell nothing
  float persistence = 0.8f;  // share of the probability of moving on by one step more
  float change = 0.01f;      // share of the probability that may change to another simulation per frame
};

/// Spans are valid until the next update() or reset().
struct TestState {
  std::uint64_t frames = 0;  // that told something
  Sample sample;             // the likeliest now, given all frames so far
  float sample_probability = 0;
  std::uint32_t simulation = 0;                       // the likeliest of the whole test so far
  std::span<const float> simulation_probabilities{};  // simulations(), of the whole test so far
  std::span<const float> branch_probabilities{};      // branches()
  float misfit = 0;  // geometric mean of the frames' misfits, weighted by how little is expected of them; 0: none told
  Verdict verdict = Verdict::unknown;  // of the whole test so far; a few frames have to come first
};

/// One per test; frames in their order. update() neither allocates nor locks nor throws; its cost is linear in
/// samples().
class LBEA_API Tracker {
 public:
  /// Throws Error{bad_config} with the offending value.
  /// `views`: as the matcher's; when empty, those baked into the model.
  explicit Tracker(Model model, const TrackerConfig& config = {}, SensorViews views = {});
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  /// Takes in a matched frame (of any method; fit's candidates tell most). Refused ones change nothing.
  const TestState& update(const MatchResult& result) noexcept;
  [[nodiscard]] const TestState& state() const noexcept;
  /// The next frame is the first of another test.
  void reset() noexcept;

 private:
  struct LBEA_HIDDEN State;
  std::unique_ptr<State> state_;
};

/// After the test: the likeliest path of samples through all its frames, on the tracker's model (Viterbi). evidence:
/// each frame's candidates, best first; empty for a frame that told nothing. One sample per frame. For offline use:
/// allocates 4 bytes per frame and sample.
[[nodiscard]] LBEA_API std::vector<Sample> likeliest_path(const Model& model,
                                                          std::span<const std::vector<Match>> evidence,
                                                          const TrackerConfig& config = {});

}  // namespace lbea
