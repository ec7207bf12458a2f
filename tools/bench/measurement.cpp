#include "tools/bench/measurement.hpp"

#include <chrono>
#include <numeric>

#include <sys/resource.h>

namespace lbea::tool::bench {
namespace {

Interruptions interruptions_so_far() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {static_cast<std::uint64_t>(usage.ru_minflt), static_cast<std::uint64_t>(usage.ru_majflt),
          static_cast<std::uint64_t>(usage.ru_nivcsw)};
}

void add(Interruptions& sum, const Interruptions& before, const Interruptions& after) {
  sum.minor_faults += after.minor_faults - before.minor_faults;
  sum.major_faults += after.major_faults - before.major_faults;
  sum.preemptions += after.preemptions - before.preemptions;
}

FrameTimes timed(Pipeline& pipeline, const Frame& frame, std::uint32_t cloud) {
  const std::uint64_t processor_begin = processor_time_ns();
  const auto begin = std::chrono::steady_clock::now();
  const auto [stages, track, infer] = pipeline.match(frame);
  const auto end = std::chrono::steady_clock::now();
  const std::uint64_t processor = processor_time_ns() - processor_begin;
  const auto total = std::chrono::duration_cast<std::chrono::nanoseconds>(end - begin).count();
  return {
      cloud,
      {stages.index, stages.correspondence, stages.projection, stages.matching, stages.depth_image, stages.ranking,
       stages.estimate, stages.judgment, stages.coverage, track, infer, static_cast<std::uint64_t>(total), processor}};
}

}  // namespace

// In integers: 0.999 * 1000 is slightly more than 999 in doubles and would be rounded up to the wrong rank.
double percentile(std::span<const double> ascending, std::uint32_t per_mille) noexcept {
  const std::size_t rank = (ascending.size() * per_mille + 999) / 1000;
  return ascending[rank - 1];
}

Statistics statistics_of(std::span<const double> values) {
  if (values.empty()) return {};
  std::vector<double> ascending(values.begin(), values.end());
  std::ranges::sort(ascending);
  return {.count = values.size(),
          .p50 = percentile(ascending, 500),
          .p90 = percentile(ascending, 900),
          .p99 = percentile(ascending, 990),
          .p99_9 = percentile(ascending, 999),
          .max = ascending.back(),
          .mean = std::accumulate(ascending.begin(), ascending.end(), 0.0) / static_cast<double>(values.size())};
}

std::uint64_t processor_time_ns() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<std::uint64_t>(time.tv_sec) * 1'000'000'000 + static_cast<std::uint64_t>(time.tv_nsec);
}

Statistics Measurement::stage_us(std::size_t stage) const {
  std::vector<double> values;
  for (const FrameTimes& frame : frames) values.push_back(static_cast<double>(frame.ns[stage]) * 1e-3);
  return statistics_of(values);
}

double Measurement::frames_per_second() const {
  const double mean = stage_us(total_stage).mean;
  return mean > 0 ? 1e6 / mean : 0;
}

std::vector<Measurement> measure(Pipelines pipelines, std::span<const BenchCloud> clouds, const Schedule& schedule,
                                 const std::function<void(std::uint64_t)>& progress) {
  std::vector<Measurement> measurements;
  for (const auto& pipeline : pipelines)
    measurements.push_back({pipeline->name(), std::vector<FrameTimes>(schedule.frames), {}});
  for (std::uint64_t i = 0; i < std::uint64_t{schedule.warm_up} + schedule.frames; ++i) {
    const auto cloud = static_cast<std::uint32_t>(i % clouds.size());
    const Frame frame = clouds[cloud].frame(i);
    for (std::size_t k = 0; k < pipelines.size(); ++k) {
      const Interruptions before = interruptions_so_far();
      const FrameTimes times = timed(*pipelines[k], frame, cloud);
      const Interruptions after = interruptions_so_far();
      if (i < schedule.warm_up) continue;
      add(measurements[k].interruptions, before, after);
      measurements[k].frames[i - schedule.warm_up] = times;
    }
    progress(i + 1);
  }
  return measurements;
}

Comparison compare(Pipelines pipelines, const BenchCloud& cloud, const BenchCloud& usual, std::uint32_t frames) {
  constexpr std::uint32_t rounds = 9;
  const Schedule schedule{.frames = std::max(frames / rounds, 1u), .warm_up = 1};
  const auto median_us = [&](const BenchCloud& timed) {
    return measure(pipelines, {&timed, 1}, schedule, [](std::uint64_t) {}).front().stage_us(processor_stage).p50;
  };
  std::vector<double> us, ratios;
  for (std::uint32_t round = 0; round < rounds; ++round) {
    us.push_back(median_us(cloud));
    ratios.push_back(us.back() / median_us(usual));
  }
  return {statistics_of(us).p50, statistics_of(ratios).p50};
}

double ratio(const Measurement& baseline, const Measurement& product, std::size_t stage) {
  return baseline.stage_us(stage).p50 / product.stage_us(stage).p50;
}

}  // namespace lbea::tool::bench
