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

namespace lbea::bench {

inline constexpr std::array<std::string_view, 6> stage_names{"index", "correspondence", "projection", "matching", "coverage", "total"};
inline constexpr std::size_t total_stage = stage_names.size() - 1;

struct FrameTimes {
  std::uint32_t cloud = 0;
  std::array<std::uint64_t, stage_names.size()> ns{};  // the last: wall time around the call
  bool undisturbed = true;                             // no other program got the processor meanwhile
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
  /// Totals of the undisturbed frames alone; of all when there is no such frame.
  [[nodiscard]] Statistics undisturbed_us() const;
  [[nodiscard]] double frames_per_second() const;  // 1 / mean total
};

struct Schedule {
  std::uint32_t frames = 1000;  // timed, per pipeline
  std::uint32_t warm_up = 100;  // before, not timed
};

using Pipelines = std::span<const std::unique_ptr<Pipeline>>;

/// One measurement per pipeline; the clouds are taken in turn. `progress` is told the number of frames done.
[[nodiscard]] std::vector<Measurement> measure(Pipelines pipelines, std::span<const BenchCloud> clouds, const Schedule& schedule,
                                               const std::function<void(std::uint64_t)>& progress);

/// p50 of the baseline's total over p50 of the product's, both of their undisturbed frames: what the rest of the machine
/// does is no part of the comparison.
[[nodiscard]] double ratio(const Measurement& baseline, const Measurement& product);

}  // namespace lbea::bench
