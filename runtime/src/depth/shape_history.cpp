#include "runtime/src/depth/shape_history.hpp"

#include "runtime/src/depth/shape_regression.hpp"
#include "runtime/src/model/model_view.hpp"

namespace lbea {
namespace {

double cost_of(double difference, const TimeBelief& belief) noexcept {
  return belief.variance > 0 ? difference * difference / (2 * belief.variance) : 0;
}

double time_cost(double time_s, const FrameExpectation& expected) noexcept {
  return cost_of(time_s - expected.time.mean_s, expected.time) +
         cost_of(std::max(time_s - expected.latest.mean_s, 0.0), expected.latest);
}

}  // namespace

[[gnu::cold]]  // compiled for size, as the next ones
void ShapeHistory::add(const EarlierShape& shape) noexcept {
  if (size_ > 0) {
    const double interval = seconds_between(latest(0).stamp_ns, shape.stamp_ns);
    if (interval < -duration_s_)
      size_ = 0;  // the sender's clock was set back
    else if (interval < least_interval * duration_s_ || interval <= 0)
      return;
  }
  shapes_[size_++ % shapes_.size()] = shape;
}

[[gnu::cold]] EarlierShapes ShapeHistory::before(std::int64_t stamp_ns) const noexcept {
  EarlierShapes shapes{};
  const double step = least_age * duration_s_;
  std::size_t found = 0;
  for (std::size_t back = 0; back < std::min(size_, shapes_.size()) && found < shapes.size(); ++back) {
    const double age = seconds_between(latest(back).stamp_ns, stamp_ns);
    if (!(age >= static_cast<double>(found + 1) * step)) continue;
    if (!(age > 0 && age <= duration_s_)) break;
    shapes[found++] = &latest(back);
  }
  return shapes;
}

[[gnu::cold]] std::span<const RankedSample> ContinuedSamples::find(const FrameExpectation& expected) noexcept {
  count_ = 0;
  for (const EarlierShape* const earlier : expected.earlier) {
    if (earlier == nullptr) continue;
    const double age_s = seconds_between(earlier->stamp_ns, expected.stamp_ns);
    for (const std::uint32_t similar : std::span(earlier->similar).first(earlier->similar_count)) {
      const RunSamples& run = states_.run_of(similar);
      const std::size_t now = states_.nearest_later(similar, age_s), last = run.first + run.count - 1;
      for (std::size_t state = std::max(now, run.first + 1) - 1; state <= std::min(now + 1, last); ++state) add(state);
    }
  }
  return std::span(found_).first(count_);
}

[[gnu::cold]] void ContinuedSamples::add(std::size_t sample) noexcept {
  const auto number = static_cast<std::uint32_t>(sample);
  const auto found = std::span(found_).first(count_);
  if (std::ranges::find(found, number, &RankedSample::sample) == found.end()) found_[count_++] = {number, 0};
}

[[gnu::cold]] ExpectationCosts::ExpectationCosts(const ModelView& model, const ShapeRegression& regression)
    : model_(model),
      regression_(regression),
      states_(model),
      costs_(model.sample_times.size()),
      squared_(costs_.size()) {}

void ExpectationCosts::assess(std::span<const RankedSample> samples, const FrameExpectation* expected) noexcept {
  is_assessed_ = expected != nullptr && !costs_.empty();
  if (!is_assessed_) return;
  for (const RankedSample& one : samples) costs_[one.sample] = 0;
  for (const EarlierShape* const earlier : expected->earlier)
    if (earlier != nullptr && regression_.blend > 0)
      add_shape_costs(samples, *earlier, seconds_between(earlier->stamp_ns, expected->stamp_ns));
  float least = std::numeric_limits<float>::infinity();  // which no sample can avoid
  for (const RankedSample& one : samples) least = std::min(least, costs_[one.sample]);
  for (const RankedSample& one : samples) costs_[one.sample] -= least;
  // A frame that clearly contradicts the earlier ones is believed. The time counts for less: it is wrong if something
  // hides a part when the test begins. In the first frame, it alone tells a component of which a part is hidden from
  // one that is crushed up to there.
  constexpr double most = 8;
  const bool is_alone = expected->is_first && expected->earlier.front() == nullptr && expected->latest.variance > 0;
  const double most_by_time = is_alone ? most : most / 2;
  for (const RankedSample& one : samples) {
    const double by_time = time_cost(model_.sample_times[one.sample], *expected);
    const double cost = (by_time < most_by_time ? by_time : most_by_time) + double{costs_[one.sample]};
    costs_[one.sample] =
        static_cast<float>(cost < most ? cost : most);  // also if the model has values that are not finite
  }
}

/// The sample's simulation had, as long ago as the earlier frame, a shape that differs from that of the frame. The
/// difference counts relative to the least one, which no sample can avoid, and the frame's error.
void ExpectationCosts::add_shape_costs(std::span<const RankedSample> samples, const EarlierShape& earlier,
                                       double age_s) noexcept {
  constexpr float weight = 0.25f;  // half of that of an independent frame: what hides a part may stay
  float least = std::numeric_limits<float>::infinity();
  for (const RankedSample& one : samples)
    least = std::min(least, squared_[one.sample] = squared_distance_before(one.sample, earlier, age_s));
  const float unit = std::max(least + square(earlier.error), std::numeric_limits<float>::min());
  for (const RankedSample& one : samples) costs_[one.sample] += weight * (squared_[one.sample] - least) / unit;
}

/// Between two states the shape changes linearly.
float ExpectationCosts::squared_distance_before(std::uint32_t sample, const EarlierShape& earlier,
                                                double age_s) const noexcept {
  const auto [before, later, share] = states_.later(sample, -age_s);
  const auto a = regression_.shape(before), b = regression_.shape(later);
  std::array<float, ShapeRegression::shape_scores> shape;
  for (std::size_t i = 0; i < shape.size(); ++i) shape[i] = a[i] + share * (b[i] - a[i]);
  return squared_distance(shape, earlier.scores);
}

}  // namespace lbea
