// Bounds of channels: they hold 90 % of the values of one more run, and no more.
#include "precompute/channels/channel_bounds.hpp"

#include "precompute/rig/counter_random.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;

namespace {

constexpr std::uint32_t runs = 99;

/// One frame per run, estimated by the next run's sample; two samples are plausible. values: a random walk.
std::vector<FrameErrors> some_frames() {
  std::vector<FrameErrors> frames;
  for (std::uint32_t run = 0; run < runs; ++run) {
    FrameErrors& frame = frames.emplace_back();
    frame.simulation = run;
    frame.sample = run;
    frame.spread = 1 + 0.01 * run;
    frame.weights = {{run + 1, 1.0f}};
    frame.plausible = {{run + 1, 0.5f}, {run + 2, 0.5f}};
  }
  return frames;
}

std::vector<float> random_walk() {
  std::vector<float> values{0};
  for (std::uint32_t i = 1; i < runs + 2; ++i)
    values.push_back(values.back() + static_cast<float>(CounterRandom(5, i).normal()));
  return values;
}

}  // namespace

TEST_CASE("a channel's bound holds the share that conformal prediction asks for") {
  const std::vector<FrameErrors> frames = some_frames();
  const std::vector<float> values = random_walk();
  constexpr double error_per_spread = 1.5;
  const ChannelBound bound = learn_channel_bound(values, frames, {.per_spread = error_per_spread});
  REQUIRE(bound.per_spread > 0);
  std::size_t within = 0, on_the_bound = 0;
  for (const FrameErrors& frame : frames) {
    const double first = double{values[frame.sample + 1]}, second = double{values[frame.sample + 2]};
    const double spread = std::abs(second - first) * std::sqrt(0.5),
                 error = std::abs(first - double{values[frame.sample]});
    const double half = bound.half_width(error_per_spread * spread, error_per_spread * frame.spread);
    within += error <= half * (1 + 1e-9) ? 1u : 0u;
    on_the_bound += std::abs(error - half) < 1e-9 * half ? 1u : 0u;
  }
  CHECK(within == 90);  // 0.9 (99 + 1) of 99
  CHECK(on_the_bound == 1);
}

TEST_CASE("a channel that does not vary, and frames without a spread, give no bound") {
  std::vector<FrameErrors> frames = some_frames();
  CHECK(learn_channel_bound(std::vector<float>(runs + 2, 3.0f), frames, {1}).per_spread == 0);
  for (FrameErrors& frame : frames) frame.spread = 0;
  CHECK(learn_channel_bound(random_walk(), frames, {1}).per_spread == 0);
  CHECK(learn_channel_bound(random_walk(), {}, {1}).per_spread == 0);
}
