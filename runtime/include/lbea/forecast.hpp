// forecast.hpp - how the test will end, and which parameters explain it, given the frames so far.
//
// The bake learns linear regressions from the shapes of a tenth, two tenths, ... of a simulation's duration to the
// runs' final shapes and parameters, and how wrong these are for runs that are not in the ensemble.
#pragma once

#include <lbea/lbea.hpp>

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

/// R^2 over left-out runs below which a parameter cannot be told from the shape.
inline constexpr float least_identifiable = 0.2f;

struct ParameterForecast {
  float value = 0;     // in the unit of Model::parameter(); near the runs' mean if it is not identifiable
  float bound_90 = 0;  // 90 % of the runs that are not in the ensemble differ by less
  float r2 = 0;        // share of the variance over left-out runs that the frames so far explain, less its standard
                       // error
  [[nodiscard]] bool is_identifiable() const noexcept { return r2 >= least_identifiable; }
};

/// A channel by all frames so far, in its unit. They also show how fast the shape changes, which a single frame does
/// not: velocities are wrong by a third of the error of MatchResult::channels.
struct ChannelForecast {
  float value = 0;           // at TestForecast::test_time_s; NaN without a frame, and after the simulations' end
  float bound_90 = 0;        // 90 % of the runs that are not in the ensemble differ by less; NaN with the value
  float final_value = 0;     // at the end of the simulations
  float final_bound_90 = 0;  // the same bound of it
};

/// Spans are valid until the next update() or reset().
struct TestForecast {
  std::uint64_t frames = 0;  // with evidence; without any, what all runs have in common
  double test_time_s = 0;    // of the latest of them
  /// simulations(), add up to 1: the final shape, and every final field, is this combination of the runs' last samples.
  /// Small weights may be negative.
  std::span<const float> run_weights{};
  float error_90 =
      0;  // the final shape's mean distance from the truth is below this in 90 % of such tests; length unit
  std::span<const float> branch_probabilities{};    // branches()
  std::span<const ParameterForecast> parameters{};  // parameters()
  std::span<const ChannelForecast> channels{};      // Model::channels(); none of models baked before they were learned
};

/// One per test. update() does not allocate, lock or throw.
class LBEA_API Forecast {
 public:
  /// Throws Error{bad_config} for a model without a forecast; see is_in().
  explicit Forecast(Model model);
  ~Forecast();
  Forecast(Forecast&&) noexcept;
  Forecast& operator=(Forecast&&) noexcept;
  /// Whether the bake has learned forecasts: it needs `views` and several runs.
  [[nodiscard]] static bool is_in(const Model& model) noexcept;

  /// Adds a frame matched by Method::fit with a TestHistory, which tells the time since the impact. Frames that no
  /// simulation fits change nothing.
  const TestForecast& update(const MatchResult& result) noexcept;
  [[nodiscard]] const TestForecast& state() const noexcept;
  /// Starts another test with the next frame.
  void reset() noexcept;

 private:
  struct LBEA_HIDDEN State;
  std::unique_ptr<State> state_;
};

/// Replaces the velocities and accelerations that a frame alone shows by those of its test. forecast: after update()
/// with the frame; without evidence in it, nothing changes, and values that have no bound get none. channels: a copy of
/// MatchResult::channels. Real-time safe.
LBEA_API void replace_rates(const Model& model, const TestForecast& forecast, const FitNumbers& frame,
                            std::span<ChannelValue> channels) noexcept;

/// The forecast's final node positions, nodes() x 3. Allocates.
[[nodiscard]] LBEA_API std::vector<float> final_positions(const Model& model, const TestForecast& forecast);

}  // namespace lbea
