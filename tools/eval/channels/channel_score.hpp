// How well channels are estimated: against those of the test's own run.
#pragma once

#include "precompute/channels/channel_history.hpp"
#include "runtime/src/channels/learned_channels.hpp"

#include <lbea/forecast.hpp>

#include <functional>
#include <vector>

namespace lbea::tool {

/// A channel in a frame.
struct ChannelScore {
  /// value, bound_90: NaN without. truth: NaN of a field, of a history that the run lacks, and from the first state on
  /// where a node is free.
  double truth = 0, value = 0, bound_90 = 0;
  double final_truth = 0, final_value = 0, final_bound_90 = 0;  // of the forecast; NaN without
};

class ChannelJudge {
 public:
  /// Sets positions to those of a state, on the nodes of the model: nodes x 3; NaN: the node is free.
  using ReadPositions = std::function<void(std::uint32_t state, std::vector<float>& positions)>;

  /// time_factor: seconds per unit of the run's times. Throws Error{bad_input} when a channel cannot be computed from
  /// the run.
  ChannelJudge(const Model& model, bake::SimulationReader& run, double time_factor, const ReadPositions& read,
               const std::string& name);

  /// forecast: with the frame; null: none.
  [[nodiscard]] std::vector<ChannelScore> scores(const MatchResult& result, const TestForecast* forecast,
                                                 std::uint32_t state) const;
  /// Wall time of the channels of one frame, ns.
  [[nodiscard]] double evaluation_ns(const MatchResult& result);

 private:
  Model model_;
  std::size_t states_;
  std::vector<float> truth_;  // channels x states
  ChannelEvaluator evaluator_;
};

}  // namespace lbea::tool
