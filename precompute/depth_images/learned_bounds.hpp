// What the bake learns about the errors of single nodes and elements.
#pragma once

#include "precompute/left_out/left_out_fitter.hpp"
#include "precompute/parallel.hpp"

#include <vector>

namespace lbea::bake {

/// Left-out frames of one kind.
struct LeftOutEstimates {
  std::span<const FrameErrors> frames;
  ErrorBound error_bound{};  // as in DepthImages
};

/// Weights that add up to 1. All runs have the same weight, however many of their states are frames.
[[nodiscard]] std::vector<double> run_weights(std::span<const FrameErrors> frames);

/// The share of left-out runs' values that a bound must hold so that it holds 90 % of those of one more run: 0.9 (n +
/// 1) / n for n runs (conformal prediction; Vovk, Gammerman, Shafer 2005), at most 1.
[[nodiscard]] double share_to_hold(std::size_t runs);
[[nodiscard]] double share_to_hold(std::span<const FrameErrors> frames);

struct WeightedValue {
  double value = 0, weight = 0;
};
/// The least value such that those up to it have this share of the weight; 0 without values.
[[nodiscard]] double weighted_quantile(std::vector<WeightedValue> values, double share);

/// Of the frames' mean errors: the growth whose bounds have the least quantile loss (Koenker, Bassett 1978). Spreads up
/// to `least` say nothing: the shapes are all the same.
[[nodiscard]] ErrorBound learn_error_bound(std::span<const FrameErrors> frames, double least);

/// Of node positions, then of each field: the share with the narrowest bounds that hold 90 % of the true values of
/// either kind of frames.
[[nodiscard]] std::vector<SpreadBound> learn_bounds(const SampleSource& source, const LeftOutEstimates& whole,
                                                    const LeftOutEstimates& hidden, const Workers& workers);

}  // namespace lbea::bake
