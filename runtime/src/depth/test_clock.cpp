#include "runtime/src/depth/test_clock.hpp"

#include <algorithm>
#include <cmath>

namespace lbea {
namespace {

constexpr double square(double v) noexcept { return v * v; }

}  // namespace

EnsembleTimes EnsembleTimes::of(const ModelView& model) noexcept {
  if (model.sample_times.empty()) return {};
  const auto [first, last] = std::ranges::minmax(model.sample_times);
  double sum = 0, count = 0;
  for (std::size_t s = 1; s < model.sample_times.size(); ++s) {
    if (model.samples[s][0] != model.samples[s - 1][0]) continue;
    sum += model.sample_times[s] - model.sample_times[s - 1];
    ++count;
  }
  return {first, last - first, sum / std::max(count, 1.0)};
}

void TestClock::set_impact(std::int64_t stamp_ns) noexcept {
  constexpr double deviation_s = 1e-6;
  is_known_ = is_started_ = has_started_ = true;
  first_ns_ = stamp_ns;
  impact_ = 0;
  P_ = {square(deviation_s), 0, 0};
}

void TestClock::add(std::int64_t stamp_ns, const TimeBelief& time) noexcept {
  if (is_known_ || !(variation_ > 0) || !(times_.duration_s > 0) || !std::isfinite(time.mean_s + time.variance)) return;
  constexpr double least_deviations = 2;  // an undeformed component may look like several of the first states
  if (is_started_)
    update(seconds_between(first_ns_, stamp_ns), time);
  else if (time.mean_s >= std::max(times_.interval_s, least_deviations * std::sqrt(time.variance)) &&
           time.mean_s <= times_.late_s())
    start(stamp_ns, time);
}

// simulation time = (1 + share) (stamp - impact) + noise, solved for the impact.
void TestClock::start(std::int64_t stamp_ns, const TimeBelief& time) noexcept {
  is_started_ = has_started_ = true;
  first_ns_ = stamp_ns;
  last_ = 0;
  contradictions_ = 0;
  impact_ = -time.mean_s;
  share_ = 0;
  const double share_variance = square(variation_);
  P_ = {square(time.mean_s) * share_variance + variance_at(time.mean_s) + time.variance, time.mean_s * share_variance,
        share_variance};
}

void TestClock::update(double since_first, const TimeBelief& time) noexcept {
  constexpr double most_deviations = 4;
  constexpr std::uint32_t most_contradictions = 5;
  const double since_impact = since_first - impact_, expected = (1 + share_) * since_impact;
  const bool is_at_rest = expected > times_.duration_s;  // from then on, the time is no evidence of the clock
  const double innovation = time.mean_s - std::min(expected, times_.duration_s);
  const double by_impact = is_at_rest ? 0 : -(1 + share_), by_share = is_at_rest ? 0 : since_impact;
  const std::array<double, 2> PH{P_[0] * by_impact + P_[1] * by_share, P_[1] * by_impact + P_[2] * by_share};
  const double variance = by_impact * PH[0] + by_share * PH[1] + variance_at(time.mean_s) + time.variance;
  if (!(square(innovation) <= square(most_deviations) * variance)) {
    if (++contradictions_ >= most_contradictions) restart();
    return;
  }
  contradictions_ = 0;
  // Frames in quick succession have the same errors.
  if (time.mean_s > times_.late_s() || std::abs(since_first - last_) < times_.interval_s / 2) return;
  last_ = since_first;
  impact_ += PH[0] / variance * innovation;
  share_ += PH[1] / variance * innovation;
  P_ = {P_[0] - PH[0] * PH[0] / variance, P_[1] - PH[0] * PH[1] / variance, P_[2] - PH[1] * PH[1] / variance};
}

double TestClock::variance_at(double time_s) const noexcept {
  return square(times_.interval_s / 2) + square(variation_ * time_s);
}

TimeBelief TestClock::since_impact(std::int64_t stamp_ns) const noexcept {
  if (!is_started_ || (stamp_ns == first_ns_ && !is_known_)) return {};  // frames without stamps have no clock
  const double time = seconds_between(first_ns_, stamp_ns) - impact_;
  if (std::abs(time) > most_durations * times_.duration_s) return {};
  return {time, P_[0]};
}

TimeBelief TestClock::of_samples(std::int64_t stamp_ns) const noexcept {
  if (!(variation_ > 0)) return {};
  TimeBelief time = since_impact(stamp_ns);
  if (time.variance > 0) time.variance += variance_at(time.mean_s);
  return time;
}

void TestClock::begin(std::int64_t stamp_ns, double earliest_s) noexcept {
  if (has_begun_) return;
  has_begun_ = true;
  earliest_s_ = earliest_s;
  begin_ns_ = stamp_ns;
}

TimeBelief TestClock::latest(std::int64_t stamp_ns) const noexcept {
  constexpr double deviation = 0.1;  // durations
  if (!(variation_ > 0) || has_started_) return {};
  const double passed = has_begun_ ? seconds_between(begin_ns_, stamp_ns) : 0;
  if (has_begun_ && !(std::isfinite(earliest_s_) && passed > 0)) return {};  // frames without stamps have no clock
  return {has_begun_ ? earliest_s_ + passed : 0, square(deviation * times_.duration_s)};
}

}  // namespace lbea
