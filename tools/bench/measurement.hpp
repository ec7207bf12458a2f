// Times pipelines frame by frame, in turns, so that changes of the machine's speed affect all of them alike.
#pragma once

#include "tools/bench/clouds.hpp"
#include "tools/bench/pipeline.hpp"

#include <functional>

namespace lbea::tool::bench {

/// Percentiles by the nearest-rank definition: the smallest measured value that at least that share of all values does
/// not exceed. Always a measured value, never interpolated.
struct Statistics {
  std::size_t count = 0;
  double p50 = 0, p90 = 0, p99 = 0, p99_9 = 0, max = 0, mean = 0;
};

/// All zero when there are no values. The order of the values does not matter.
[[nodiscard]] Statistics statistics_of(std::span<const double> values);

/// The nearest-rank percentile of values in ascending order, at least one: `per_mille` from 1 to 1000.
[[nodiscard]] double percentile(std::span<const double> ascending, std::uint32_t per_mille) noexcept;

// The matcher's stages, then the wall time of the call and its processor time (of this thread). On a busy machine,
// compare by processor time, which leaves out other programs.
inline constexpr std::array<std::string_view, 13> stage_names{
    "index",    "correspondence", "projection", "matching", "image", "ranking",  "estimate",
    "judgment", "coverage",       "track",      "infer",    "total", "processor"};
inline constexpr std::size_t total_stage = 11, processor_stage = 12;

/// Processor time of this thread so far.
[[nodiscard]] std::uint64_t processor_time_ns();

struct FrameTimes {
  std::uint32_t cloud = 0;
  std::array<std::uint64_t, stage_names.size()> ns{};
};

/// Counted by the operating system for this thread while a pipeline was timed.
struct Interruptions {
  std::uint64_t minor_faults = 0, major_faults = 0;
  std::uint64_t preemptions = 0;  // involuntary context switches
};

struct Measurement {
  std::string pipeline;
  std::vector<FrameTimes> frames;
  Interruptions interruptions;

  [[nodiscard]] Statistics stage_us(std::size_t stage) const;
  [[nodiscard]] double frames_per_second() const;  // 1 / mean total
};

struct Schedule {
  std::uint32_t frames = 1000;  // timed frames per pipeline
  std::uint32_t warm_up = 100;  // frames before those, not timed
};

using Pipelines = std::span<const std::unique_ptr<Pipeline>>;

/// One measurement per pipeline; the clouds are used in turn. `progress` receives the number of frames done.
[[nodiscard]] std::vector<Measurement> measure(Pipelines pipelines, std::span<const BenchCloud> clouds,
                                               const Schedule& schedule,
                                               const std::function<void(std::uint64_t)>& progress);

/// Processor time of the first pipeline for one cloud, and its ratio to that for the usual cloud. Both are medians over
/// rounds of both clouds in turn, because other programs' load varies.
struct Comparison {
  double us, ratio;
};
[[nodiscard]] Comparison compare(Pipelines pipelines, const BenchCloud& cloud, const BenchCloud& usual,
                                 std::uint32_t frames);

/// p50 of the baseline over p50 of the product.
[[nodiscard]] double ratio(const Measurement& baseline, const Measurement& product, std::size_t stage);

}  // namespace lbea::tool::bench
