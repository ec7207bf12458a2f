#include "precompute/channels/channel_bounds.hpp"

#include "precompute/depth_images/learned_bounds.hpp"

#include <cmath>
#include <limits>

namespace lbea::bake {
namespace {

struct ChannelFrame {
  double weight = 0;
  double error = 0;           // |estimate - truth|, channel unit
  double spread = 0;          // as in ChannelBound
  double estimate_error = 0;  // error_90
};

std::vector<WeightedIndex> indices(std::span<const std::pair<std::size_t, float>> samples) {
  std::vector<WeightedIndex> result;
  for (const auto& [sample, weight] : samples) result.push_back({static_cast<std::uint32_t>(sample), weight});
  return result;
}

std::vector<ChannelFrame> compare(std::span<const float> values, std::span<const FrameErrors> frames,
                                  const ErrorBound& error_bound) {
  const std::vector<double> weights = run_weights(frames);
  std::vector<ChannelFrame> compared;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const FrameErrors& frame = frames[i];
    if (!(frame.spread > 0)) continue;  // such frames get no bound
    const double value = weighted_value(values, indices(frame.weights));
    const double per_spread = error_bound.per_spread_at(frame.spread);
    compared.push_back({weights[i], std::abs(value - double{values[frame.sample]}),
                        per_spread * weighted_deviation(values, indices(frame.plausible), value),
                        per_spread * frame.spread});
  }
  return compared;
}

struct Means {
  double spread = 0, estimate_error = 0, all = 0;
};
Means means_of(std::span<const ChannelFrame> frames) {
  Means means;
  for (const ChannelFrame& frame : frames) {
    means.all += frame.weight;
    means.spread += frame.weight * frame.spread;
    means.estimate_error += frame.weight * frame.estimate_error;
  }
  means.spread /= means.all;
  means.estimate_error /= means.all;
  return means;
}

/// The bound of this form, and its mean width.
std::pair<ChannelBound, double> scaled(ChannelBound form, std::span<const ChannelFrame> frames, double share) {
  form.per_spread = 1;
  std::vector<WeightedValue> ratios;
  double width = 0;
  for (const ChannelFrame& frame : frames) {
    const double half = form.half_width(frame.spread, frame.estimate_error);
    ratios.push_back({frame.error / half, frame.weight});
    width += frame.weight * half;
  }
  form.per_spread = weighted_quantile(std::move(ratios), share);
  return {form, form.per_spread * width};
}

}  // namespace

ChannelBound learn_channel_bound(std::span<const float> values, std::span<const FrameErrors> frames,
                                 const ErrorBound& error_bound) {
  const std::vector<ChannelFrame> compared = compare(values, frames, error_bound);
  if (compared.empty()) return {};
  const Means means = means_of(compared);
  if (!(means.spread > 0 && means.estimate_error > 0)) return {};
  const double share = share_to_hold(frames);
  ChannelBound narrowest;
  double least = std::numeric_limits<double>::infinity();
  for (const double of_error : {0.0, 0.25, 0.5, 1.0, 2.0})
    for (const double constant : {0.0625, 0.25, 0.5, 1.0, 2.0}) {
      const ChannelBound form{1, of_error * means.spread / means.estimate_error, constant * means.spread};
      const auto [bound, width] = scaled(form, compared, share);
      if (!(width < least) || !format::is_measured(bound.per_spread)) continue;
      least = width;
      narrowest = bound;
    }
  return narrowest;
}

}  // namespace lbea::bake
