// Times pipelines frame by frame, in turns, so that whatever the machine does meanwhile does it to all of them.
#pragma once

#include "tools/bench/clouds.hpp"
#include "tools/bench/pipeline.hpp"
#include "tools/bench/statistics.hpp"

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool::bench {

// The matcher's stages; then the wall time around the call; then the time that the thread was on a processor meanwhile.
// They differ by what other programs took: on a busy machine the latter is the one to compare by.
inline constexpr std::array<std::string_view, 7> stage_names{"index",    "correspondence", "projection", "matching",
                                                             "coverage", "total",          "processor"};
inline constexpr std::size_t total_stage = 5, processor_stage = 6;

/// How long this thread has been on a processor so far.
[[nodiscard]] std::uint64_t processor_time_ns();

struct FrameTimes {
  std::uint32_t cloud = 0;
  std::array<std::uint64_t, stage_names.size()> ns{};
};

/// What the operating system counted for this thread while a pipeline was timed.
struct Disturbances {
  std::uint64_t minor_faults = 0, major_faults = 0;
  std::uint64_t preemptions = 0;  // involuntary context switches
};

struct Measurement {
  std::string pipeline;
  std::vector<FrameTimes> frames;
  Disturbances disturbances;

  [[nodiscard]] Statistics stage_us(std::size_t stage) const;
  [[nodiscard]] double frames_per_second() const;  // 1 / mean total
};

struct Schedule {
  std::uint32_t frames = 1000;  // timed, per pipeline
  std::uint32_t warm_up = 100;  // before, not timed
};

using Pipelines = std::span<const std::unique_ptr<Pipeline>>;

/// One measurement per pipeline; the clouds are taken in turn. `progress` is told the number of frames done.
[[nodiscard]] std::vector<Measurement> measure(Pipelines pipelines, std::span<const BenchCloud> clouds,
                                               const Schedule& schedule,
                                               const std::function<void(std::uint64_t)>& progress);

/// p50 of the baseline over p50 of the product.
[[nodiscard]] double ratio(const Measurement& baseline, const Measurement& product, std::size_t stage);

}  // namespace lbea::tool::bench
