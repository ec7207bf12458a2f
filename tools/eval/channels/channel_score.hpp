// How well channels are estimated: against those of the test's own run.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/channels/channel_history.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "tools/eval/truth.hpp"

#include <lbea/forecast.hpp>

#include <functional>
#include <vector>

namespace lbea::tool {

/// A channel in a frame.
struct ChannelScore {
  /// value, bound_90: NaN without. truth: NaN of a field or history that the run lacks, of a field where its mesh is
  /// another or all elements of the channel are eroded, and from the first state on where a node is free.
  double truth = 0, value = 0, bound_90 = 0;
  double final_truth = 0, final_value = 0, final_bound_90 = 0;  // of the forecast; NaN without
};

class ChannelJudge {
 public:
  /// Of the test's own run in a state.
  struct TrueState {
    std::vector<float> positions;  // on the nodes of the model: nodes x 3; NaN: the node is free
    TrueFields fields;
  };
  using ReadState = std::function<TrueState(std::uint32_t state)>;

  /// channels: as the bake of the model reports them. time_factor: seconds per unit of the run's times. Throws
  /// Error{bad_input} when a channel cannot be computed from the run.
  ChannelJudge(const Model& model, std::span<const bake::ChannelReport> channels, bake::SimulationReader& run,
               double time_factor, const ReadState& read, const std::string& name);

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
