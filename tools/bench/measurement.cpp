#include "tools/bench/measurement.hpp"

#include <chrono>

#include <sys/resource.h>

namespace lbea::bench {

namespace {

Disturbances disturbances_so_far() {
  rusage usage{};
  getrusage(RUSAGE_THREAD, &usage);
  return {static_cast<std::uint64_t>(usage.ru_minflt), static_cast<std::uint64_t>(usage.ru_majflt),
          static_cast<std::uint64_t>(usage.ru_nivcsw)};
}

Disturbances operator-(const Disturbances& after, const Disturbances& before) {
  return {after.minor_faults - before.minor_faults, after.major_faults - before.major_faults, after.preemptions - before.preemptions};
}

void add(Disturbances& sum, const Disturbances& more) {
  sum.minor_faults += more.minor_faults;
  sum.major_faults += more.major_faults;
  sum.preemptions += more.preemptions;
}

double microseconds(std::uint64_t ns) { return static_cast<double>(ns) * 1e-3; }

FrameTimes timed(Pipeline& pipeline, const Frame& frame, std::uint32_t cloud) {
  const auto begin = std::chrono::steady_clock::now();
  const StageTimes stages = pipeline.match(frame);
  const auto end = std::chrono::steady_clock::now();
  const auto total = std::chrono::duration_cast<std::chrono::nanoseconds>(end - begin).count();
  return {cloud, {stages.index, stages.correspondence, stages.projection, stages.matching, stages.coverage, static_cast<std::uint64_t>(total)}, true};
}

}  // namespace

Statistics Measurement::stage_us(std::size_t stage) const {
  std::vector<double> values;
  for (const FrameTimes& frame : frames) values.push_back(microseconds(frame.ns[stage]));
  return statistics_of(values);
}

Statistics Measurement::undisturbed_us() const {
  std::vector<double> values;
  for (const FrameTimes& frame : frames)
    if (frame.undisturbed) values.push_back(microseconds(frame.ns[total_stage]));
  return values.empty() ? stage_us(total_stage) : statistics_of(values);
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
      const Disturbances before = disturbances_so_far();
      FrameTimes times = timed(*pipelines[k], frame, cloud);
      const Disturbances during = disturbances_so_far() - before;
      if (i < schedule.warm_up) continue;
      times.undisturbed = during.preemptions == 0;
      add(measurements[k].disturbances, during);
      measurements[k].frames[i - schedule.warm_up] = times;
    }
    progress(i + 1);
  }
  return measurements;
}

double ratio(const Measurement& baseline, const Measurement& product) {
  return baseline.undisturbed_us().p50 / product.undisturbed_us().p50;
}

}  // namespace lbea::bench
