#include "runtime/src/fit/test_history.hpp"

namespace lbea {

HistoryState::HistoryState(const ModelView& model, double length_per_mm, const DepthImages* images)
    : model_checksum(model.file_checksum),
      estimates_pose(images != nullptr && images->pose_variance > 0),
      pose(PoseCenter::of(model), length_per_mm, EnsembleTimes::of(model).duration_s,
           images != nullptr ? images->pose_errors : PoseErrors(),
           images != nullptr ? images->pose_errors_by_points : std::nullopt),
      shapes(EnsembleTimes::of(model).duration_s),
      hidden(images != nullptr ? images->camera : DepthCamera{}),
      impact_s(EnsembleTimes::of(model).impact_s),
      clock(EnsembleTimes::of(model), images != nullptr ? double{images->time_variation} : 0) {}

void HistoryState::reset() noexcept {
  pose.reset();
  shapes.reset();
  hidden.reset();
  clock.reset();
}

void HistoryState::begin_frame(std::int64_t stamp) noexcept {
  stamp_ns = stamp;
  pose.begin_frame(stamp);
}

FrameExpectation HistoryState::expectation() const noexcept {
  FrameExpectation expectation{stamp_ns, shapes.before(stamp_ns), clock.of_samples(stamp_ns), clock.latest(stamp_ns),
                               !clock.has_begun()};
  expectation.time.mean_s += impact_s;
  expectation.latest.mean_s += impact_s;
  return expectation;
}

void HistoryState::see(SurfaceFitter& fitter) noexcept {
  const bool shows_enough = fitter.verdict() != Verdict::unknown;  // a few points look like any shape
  if (shows_enough || !fitter.gives_verdicts()) clock.begin(stamp_ns, fitter.search().earliest_s());
  if (fitter.is_explained()) fitter.update(hidden);
}

void HistoryState::add(const EarlierShape& shape, const TimeBelief& time) noexcept {
  shapes.add(shape);
  add_time(time);
}

void HistoryState::add_time(const TimeBelief& time) noexcept {
  clock.add(stamp_ns, {time.mean_s - impact_s, time.variance});
}

void HistoryState::write_time(std::int64_t at_ns, FitNumbers& numbers) const noexcept {
  const TimeBelief time = clock.since_impact(at_ns);
  if (!(time.variance > 0)) return;
  numbers.test_time = static_cast<float>(time.mean_s);
  numbers.test_time_sd = static_cast<float>(std::sqrt(time.variance));
}

EarlierShape shape_shown(std::int64_t stamp_ns, const ShapeEstimate& estimate, float error_90, float spread) noexcept {
  constexpr float deviations = 2;  // of a mean distance that 90 % do not reach
  EarlierShape shown{stamp_ns, std::isfinite(error_90) ? error_90 / deviations : spread, estimate.shape()};
  static_assert(ShapeEstimate::most_nearest <= EarlierShape::most_similar);
  for (const RankedSample& one : estimate.nearest()) shown.similar[shown.similar_count++] = one.sample;
  return shown;
}

TestHistory::TestHistory(const Model& model, const SensorViews& views) {
  const SensorViews used = views.empty() ? SensorViews::baked_into(model) : views;
  state_ = std::make_unique<HistoryState>(model.view(), units_per_mm(model.length_unit()), used.data());
}
TestHistory::~TestHistory() = default;
TestHistory::TestHistory(TestHistory&&) noexcept = default;
TestHistory& TestHistory::operator=(TestHistory&&) noexcept = default;
void TestHistory::fix_pose() noexcept {
  state_->estimates_pose = false;
  state_->pose.reset();
}
void TestHistory::set_impact(std::int64_t stamp_ns) noexcept { state_->clock.set_impact(stamp_ns); }
bool TestHistory::estimates_pose() const noexcept { return state_->estimates_pose; }
RigidTransform TestHistory::pose_correction() const noexcept { return state_->pose.transform(); }
void TestHistory::reset() noexcept { state_->reset(); }

}  // namespace lbea
