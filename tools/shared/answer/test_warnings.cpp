#include "tools/shared/answer/test_warnings.hpp"

#include "tools/shared/answer/clock_times.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <limits>

namespace lbea::tool {
namespace {

// From the right pose, a rig covers 95 to 100 % of what it can see of the undeformed component, 80 % with 4,000 points;
// 5 mm or 3 degrees off, 30 to 70 %.
constexpr float least_undeformed_coverage = 0.7f;
constexpr float many_departed = 0.25f;  // sparks and dust are less

}  // namespace

bool UndeformedCoverage::add(const wire::WireResult& result) {
  if (wire::fate_of(result.status) != wire::Fate::matched) return false;
  const bool is_first = std::exchange(session_, result.session) != result.session;
  const bool is_initial = !result.matches.empty() && result.matches.front().sample.time_step == 0;
  if (!is_first && !is_initial) return false;
  latest_ = result.coverage;
  rig_.clear();
  for (const wire::WireRigFrame& frame : result.rigs)
    if (frame.is_used && frame.coverage < *latest_) latest_ = frame.coverage, rig_ = frame.rig;
  return true;
}

bool UndeformedCoverage::is_low() const noexcept { return latest_ && *latest_ < least_undeformed_coverage; }

std::string rig_prefix(std::string_view rig) { return rig.empty() ? "" : "rig " + std::string(rig) + ": "; }

std::string pose_warning(float coverage, std::string_view rig) {
  const std::string of(rig);
  return rig_prefix(rig) +
         formatted(
             "the frames cover only %.0f %% of the undeformed component: the pose or the model is wrong, something "
             "hides it, or there are few points; check --pose%s%s, and refine it with lbea-register",
             100 * double{coverage}, of.empty() ? "" : " ", of.c_str());
}

std::optional<bool> TestDivision::begins(const wire::WireResult& result) noexcept {
  if (result.status == wire::WireStatus::end_of_stream && session_ == result.session) session_.reset();
  if (wire::fate_of(result.status) != wire::Fate::matched) return std::nullopt;
  return std::exchange(session_, result.session) != result.session;
}

bool DepartedPoints::add(const wire::WireResult& result) noexcept {
  const std::optional<bool> begins = tests_.begins(result);
  const bool is_gone =
      !result.component.empty() && result.status == wire::WireStatus::empty_frame && tests_.has(result);
  if (!begins && !is_gone) return false;
  if (begins.value_or(false)) {
    first_ = result.points;
    first_near_none_ = result.points_near_none;
  }
  const auto rise = [](std::uint32_t from, std::uint32_t to) { return to - std::min(from, to); };
  const std::uint32_t departed = result.component.empty() ? rise(first_.culled, result.points.culled)
                                                          : std::min(rise(first_near_none_, result.points_near_none),
                                                                     rise(result.points.used, first_.used));
  share_ = static_cast<float>(departed) / static_cast<float>(std::max(first_.used, 1u));
  return true;
}

bool DepartedPoints::are_many() const noexcept { return share_ > many_departed; }

std::string departure_warning(float share) {
  return formatted(
      "more points than in the first frame are near no simulation, %.0f %% of the component's: a part may have torn "
      "off or moved away; the verdict does not consider these points",
      100 * double{share});
}

void SimulatedPace::add(double simulated_s, std::int64_t stamp_ns) noexcept {
  if (count_ > 0 && !(simulated_s > passages_[count_ - 1].simulated_s)) return;
  if (count_ == most) {
    for (std::size_t i = 0; i < most / 2; ++i) passages_[i] = passages_[2 * i];
    count_ = most / 2;
  }
  passages_[count_++] = {simulated_s, stamp_ns};
  if (count_ >= fewest) per_second_ = median_slope();
}

double SimulatedPace::median_slope() const noexcept {
  std::array<double, most*(most - 1) / 2> slopes;
  std::size_t n = 0;
  for (std::size_t i = 0; i < count_; ++i)
    for (std::size_t j = i + 1; j < count_; ++j) {
      const double passed_s = difference_ns(passages_[j].stamp_ns, passages_[i].stamp_ns) * 1e-9;
      slopes[n++] = passed_s > 0 ? (passages_[j].simulated_s - passages_[i].simulated_s) / passed_s
                                 : std::numeric_limits<double>::infinity();
    }
  const auto middle = slopes.begin() + static_cast<std::ptrdiff_t>(n / 2);
  std::nth_element(slopes.begin(), middle, slopes.begin() + static_cast<std::ptrdiff_t>(n));
  return *middle;
}

void CaptureTimes::add(const wire::WireResult& result) noexcept {
  constexpr double least_interval = 1e3, longest_disorder = 1e6, longest_gap = 1e10;  // ns; no camera is faster
  const std::optional<bool> begins = tests_.begins(result);
  if (!begins) return;
  if (*begins) {
    intervals_ = wrong_ = 0;
    goes_back_ = has_gap_ = false;
    pace_.begin();
  } else if (result.frame_id > latest_id_) {
    ++intervals_;
    const double interval = difference_ns(result.stamp_ns, latest_ns_);
    if (interval < least_interval) ++wrong_;
    // When a rig's clock is corrected, its frames that wait are of an earlier time.
    const bool is_corrected =
        std::ranges::any_of(result.rigs, [](const wire::WireRigFrame& rig) { return rig.clock_correction_ns != 0; });
    goes_back_ |= interval < -longest_disorder && !is_corrected;
    has_gap_ |= interval > longest_gap;
  } else {
    return;  // reordered
  }
  latest_id_ = result.frame_id;
  latest_ns_ = result.stamp_ns;
  if (result.verdict == wire::WireVerdict::matched && !result.matches.empty())
    pace_.add(result.matches.front().time_s, result.stamp_ns);
}

CaptureTimes::Problem CaptureTimes::problem() const noexcept {
  constexpr std::uint64_t fewest = 3;
  if (intervals_ >= fewest && 2 * wrong_ > intervals_) return Problem::not_increasing;
  if (goes_back_) return Problem::going_back;
  if (has_gap_) return Problem::gap;
  return problem_of_pace();
}

// Shapes of an unseen run are most like those of other runs 17 % earlier or later.
CaptureTimes::Problem CaptureTimes::problem_of_pace() const noexcept {
  constexpr double fastest = 1.7, slowest = 0.5;
  const std::optional<double> pace = pace_.per_second();
  if (!pace) return Problem::none;
  return *pace > fastest ? Problem::fast : *pace < slowest ? Problem::slow : Problem::none;
}

std::string capture_times_warning(CaptureTimes::Problem problem) {
  using enum CaptureTimes::Problem;
  const std::string two_tests = ": if these are two tests, end the stream after each, and reset the history";
  switch (problem) {
    case not_increasing:
      return "the stamps of most frames do not increase, or by less than 1 microsecond: are they capture times in ns? "
             "Matching uses the times of a test";
    case going_back:
      return "the stamps go back within the test" + two_tests;
    case gap:
      return "the stamps of the test have a gap of more than 10 s" + two_tests;
    case fast:
      return "the shapes change much faster than the stamps: are they capture times in ns? Velocities, accelerations "
             "and forecasts are wrong";
    case slow:
      return "the shapes change much more slowly than the stamps: are they capture times in ns? Velocities, "
             "accelerations and forecasts are wrong";
    case none:
      break;
  }
  return "";
}

void RigUse::add(const wire::WireResult& result) {
  const std::optional<bool> begins = tests_.begins(result);
  if (!begins) return;
  if (*begins) {
    rigs_.clear();
    contradictions_ = {};
  }
  contradictions_.add(are_contradictory(result.verdict, result.rigs));
  for (const wire::WireRigFrame& frame : result.rigs) {
    auto rig = std::ranges::find(rigs_, frame.rig, &Rig::name);
    if (rig == rigs_.end()) rig = rigs_.insert(rigs_.end(), {frame.rig});
    rig->frames += frame.status == wire::WireStatus::ok || frame.points.received > 0 ? 1 : 0;
    rig->used += frame.is_used ? 1 : 0;
  }
}

std::optional<RigUse::Unused> RigUse::unused() const noexcept {
  constexpr std::uint32_t fewest = 8;
  for (const Rig& rig : rigs_)
    if (rig.frames >= fewest && 2 * rig.used < rig.frames) return Unused{rig.name, rig.frames, rig.used};
  return std::nullopt;
}

std::string contradiction_warning() {
  return "the rigs see different shapes: one of them sees another component or another test, or its pose is wrong; "
         "check --pose, and the endpoints";
}

std::string unused_rig_warning(const RigUse::Unused& unused) {
  return rig_prefix(unused.rig) + "the results rest on " + std::to_string(unused.used) + " of its " +
         std::to_string(unused.frames) +
         " frames; the others show nothing near a simulation, few points, or something else than the other rigs' "
         "frames: check the unit of the points, and --pose " +
         std::string(unused.rig);
}

}  // namespace lbea::tool
