// How wrong the channels' estimates are in the frames of left-out runs.
#pragma once

#include "precompute/left_out/left_out_fitter.hpp"
#include "runtime/src/channels/learned_channels.hpp"

namespace lbea::bake {

/// The narrowest bound that holds 90 % of the true values of one more run, of those tried; see share_to_hold().
/// values: of the channel, per sample. error_bound: as in DepthImages.
[[nodiscard]] ChannelBound learn_channel_bound(std::span<const float> values, std::span<const FrameErrors> frames,
                                               const ErrorBound& error_bound);

}  // namespace lbea::bake
