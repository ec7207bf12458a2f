// The frames of several rigs, each by the steps of Matcher, then together.
#include "runtime/src/match/rig_matcher.hpp"

namespace lbea {
namespace {

constexpr double ns_per_s = 1e9;
constexpr double most_apart = 0.1;  // durations of a simulation: frames farther from the latest one are of another time

// Of stamps; they wrap around.
std::int64_t sum(std::int64_t a, std::int64_t b) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}
std::int64_t difference(std::int64_t a, std::int64_t b) noexcept {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}

void add(const PointTally& of_rig, PointTally& points) noexcept {
  points.received += of_rig.received;
  points.invalid += of_rig.invalid;
  points.culled += of_rig.culled;
  points.used += of_rig.used;
}

}  // namespace

void RigMatcher::State::match_alone(std::size_t rig, Frame frame) noexcept {
  Matcher::State& matcher = *matchers[rig];
  frame.stamp_ns = sum(frame.stamp_ns, offsets_ns[rig]);
  if (captures[rig].has_frame)
    histories[rig].pose = poses_before[rig];  // another frame of the rig in the same capture: the last one counts
  else
    poses_before[rig] = histories[rig].pose;
  MatchResult alone;
  matcher.begin_frame(frame, &histories[rig]);  // by the rig's own clock
  frame.stamp_ns = sum(frame.stamp_ns, corrections_ns[rig]);
  captures[rig] = {frame.id, frame.stamp_ns, frame.points, true};
  bool is_indexed = false;
  do {
    is_indexed = matcher.index_points(frame, alone);
    if (is_indexed) matcher.fit(alone, !poses_by_all[rig]);
  } while (is_indexed && !poses_by_all[rig] && matcher.move_pose(alone));
  captures[rig].times = alone.elapsed_ns;
  results[rig] = {alone.fit, {}, alone.status, Verdict::unknown, alone.points, false};
  if (!is_indexed) return;
  captures[rig].shown = std::min(matcher.fitter->shown_share(matcher.fitter->search().sample(0)), 1.0f);
  results[rig].verdict = matcher.fitter->verdict();
}

MatchResult RigMatcher::State::combine() noexcept {
  MatchResult result;
  result.status = Status::empty_frame;
  begin_capture(result);
  compare_clocks();
  find_latest();
  choose_evidence(result);
  if (used == 0) {
    cover(result);
    return result;
  }
  Stopwatch watch;
  joint_history.begin_frame(result.stamp_ns);
  FrameExpectation expected = joint_history.expectation();
  if (expected.is_first) begin_test(expected);
  bool corrects = false;
  do {
    result.fit = fitter.fit(std::span(evidence).first(used), &expected);
    corrects = !is_contradicted();
    if (corrects)
      fitter.correct(result.fit);
    else
      fitter.begin_correction();
  } while (move_poses(corrects));
  if (!corrects)
    result.fit.error_90 = FitNumbers{}.error_90;
  else if (fitter.is_explained())
    refine_clocks();
  result.elapsed_ns.fit += watch.lap_ns();
  cover(result);
  result.elapsed_ns.coverage += watch.lap_ns();
  remember(result);
  publish(result);
  return result;
}

/// By the joint estimate at the time of each rig's frame; of a rig that the result does not rest on, by its own one.
void RigMatcher::State::cover(MatchResult& result) noexcept {
  fitter.side_by_side(matchers.size(), [this](std::size_t rig) {
    if (is_indexed(rig)) cover(rig);
  });
  if (used == 0) return;
  Matcher::State& first = *matchers[lead];
  for (std::size_t rig = lead + 1; rig < matchers.size(); ++rig)
    if (results[rig].is_used) first.surface->add(*matchers[rig]->surface);
  result.coverage = first.surface->coverage(*first.reference);
  result.status = first.status_of(result.coverage);
}

void RigMatcher::State::cover(std::size_t rig) noexcept {
  Matcher::State& matcher = *matchers[rig];
  const bool is_used = results[rig].is_used;
  if (!is_used) matcher.fitter->begin_correction(matcher.fitter->estimate(), matcher.index);
  results[rig].coverage =
      matcher.cover(is_used ? fitter.best_for(captures[rig].place) : matcher.fitter->search().sample(0));
  results[rig].status = matcher.status_of(results[rig].coverage);
}

/// A rig from which nothing is hidden tells the time of a first frame.
void RigMatcher::State::begin_test(FrameExpectation& first) const noexcept {
  first.begin_at(earliest_s());
  const auto is_hidden = [](const RigEvidence& rig) { return rig.fitter->is_hidden(); };
  first.is_first = std::ranges::all_of(std::span(evidence).first(used), is_hidden);
}

/// By all rigs' frames instead of each one's own. Returns whether a pose changed, so that its frame was matched again.
bool RigMatcher::State::move_poses(bool by_points) noexcept {
  std::array<bool, most_rigs> has_moved{};
  fitter.side_by_side(matchers.size(),
                      [&](std::size_t rig) { has_moved[rig] = results[rig].is_used && move_pose(rig, by_points); });
  return std::ranges::find(has_moved, true) != has_moved.end();
}

bool RigMatcher::State::move_pose(std::size_t rig, bool by_points) noexcept {
  Matcher::State& matcher = *matchers[rig];
  if (matcher.pose == nullptr) return false;
  matcher.pose->reconsider(poses_before[rig]);  // a frame is one measurement, however often it is matched
  const double since_impact = fitter.time().mean_s - joint_history.impact_s;
  const PoseBelief posterior = fitter.pose_of(captures[rig].place, matcher.pose->prior());
  const auto measured = by_points ? matcher.pose_by_points() : std::nullopt;
  if (!matcher.pose->move(posterior, fitter.is_explained(), since_impact, measured, matcher.fitter->hidden_residual()))
    return false;
  MatchResult alone;
  if (matcher.index_points({captures[rig].frame_id, captures[rig].stamp_ns, captures[rig].points}, alone))
    matcher.fit(alone);
  return true;
}

/// The earliest time since the impact, at the stamp of the lead, of the rigs that know one; minus infinity: none does.
double RigMatcher::State::earliest_s() const noexcept {
  double earliest = -std::numeric_limits<double>::infinity();
  for (const RigEvidence& rig : std::span(evidence).first(used))
    if (const double by_rig = rig.fitter->search().earliest_s(); std::isfinite(by_rig))
      earliest = std::max(earliest, by_rig - rig.later_s);
  return earliest;
}

/// Whether the rigs that are used see different shapes, or one that shows enough of the component, and on which the
/// result does not rest, says that no simulation fits: it may see another component, or a deformation that the others
/// do not see.
bool RigMatcher::State::is_contradicted() const noexcept {
  if (fitter.is_contradictory()) return true;
  for (std::size_t rig = 0; rig < matchers.size(); ++rig) {
    const RigResult& alone = results[rig];
    if (!alone.is_used && is_in_time(rig) && alone.verdict == Verdict::no_simulation_fits &&
        captures[rig].shown >= least_bounded)
      return true;
  }
  return false;
}

/// Frames that no simulation explains are evidence only if no explained one shows nearly as much: they show another
/// component, or what hides this one. Sparse ones, which say nothing about that, are evidence only if none is
/// explained. Nor are frames of another time than the latest one.
void RigMatcher::State::choose_evidence(MatchResult& result) noexcept {
  constexpr float nearly = 0.8f;
  float shown = 0;  // by explained frames
  for (std::size_t rig = 0; rig < matchers.size(); ++rig)
    if (is_explained(rig) && is_in_time(rig)) shown = std::max(shown, captures[rig].shown);
  used = 0;
  for (std::size_t rig = 0; rig < matchers.size(); ++rig) {
    const bool counts = is_explained(rig) || (is_indexed(rig) && nearly * captures[rig].shown >= shown &&
                                              (shown == 0 || !fitter_of(rig).is_sparse(captures[rig].shown)));
    results[rig].is_used = counts && is_in_time(rig);
    if (!results[rig].is_used) continue;
    if (used == 0) lead = rig;
    captures[rig].place = used;
    evidence[used++] = {&fitter_of(rig), &matchers[rig]->index,
                        seconds_between(captures[lead].stamp_ns, captures[rig].stamp_ns)};
  }
  result.frame_id = captures[lead].frame_id;
  result.stamp_ns = captures[lead].stamp_ns;
}

/// Adds up points and times.
void RigMatcher::State::begin_capture(MatchResult& result) noexcept {
  for (std::size_t rig = matchers.size(); rig-- > 0;) {
    if (captures[rig].has_frame)
      lead = rig;
    else
      captures[rig] = {}, results[rig] = {};
    captures[rig].has_frame = false;
    if (results[rig].status == Status::too_many_points) result.status = Status::too_many_points;
    add(results[rig].points, result.points);
    result.elapsed_ns.index += captures[rig].times.index;
    result.elapsed_ns.fit += captures[rig].times.fit;
  }
}

/// Every rig sees the same impact: the first rig's clock is the common one.
void RigMatcher::State::compare_clocks() noexcept {
  for (std::size_t rig = 0; rig < matchers.size(); ++rig) {
    HistoryState& own = histories[rig];
    if (is_explained(rig)) own.add_time(fitter_of(rig).time());
    const std::int64_t before_ns = std::exchange(corrections_ns[rig], correction_ns(rig));
    captures[rig].stamp_ns = sum(captures[rig].stamp_ns, difference(corrections_ns[rig], before_ns));
    results[rig].clock_correction_ns = corrections_ns[rig];
    if ((corrections_ns[rig] == 0) != (before_ns == 0)) own.shapes.reset();  // they were of another time
  }
}

/// As before, if one of the rigs has not seen the impact. Clocks are regarded as synchronized if they differ by less
/// than the interval between states or by less than what the frames tell. Impacts that are farther apart than a
/// simulation lasts are not the same one. The frames after the impact tell more, unless they contradict it.
std::int64_t RigMatcher::State::correction_ns(std::size_t rig) noexcept {
  constexpr double least_deviations = 2;
  ClockMeasurements& measured = measured_clocks[rig];
  const TimeBelief first = histories[0].since_impact(), own = histories[rig].since_impact();
  if (!(first.variance > 0) || !(own.variance > 0)) return corrections_ns[rig];
  const double apart_s = seconds_between(histories[rig].stamp_ns, histories[0].stamp_ns);
  const double behind_s = apart_s + own.mean_s - first.mean_s;
  const double deviation_s = std::sqrt(std::max(first.variance, own.variance));
  const double least_s = std::max(times.interval_s, least_deviations * deviation_s);
  const bool differs = std::abs(behind_s) >= least_s && std::abs(behind_s) <= times.duration_s;
  const double measured_s = measured.sum_s / measured.count;  // not a number without measurements
  if (differs && std::abs(measured_s - behind_s) < least_s) return std::llround(ns_per_s * measured_s);
  measured = {};
  return differs ? std::llround(ns_per_s * behind_s) : 0;
}

/// By the frames in the first half of the simulations: the same combination of samples is moved to where it explains
/// each rig's frame best. If an unseen run deforms earlier or later than the samples, all rigs see that.
void RigMatcher::State::refine_clocks() noexcept {
  if (!results[0].is_used || fitter.time().mean_s - joint_history.impact_s > times.duration_s / 2) return;
  if (std::ranges::count(corrections_ns, 0) == std::ssize(corrections_ns)) return;
  std::array<double, most_rigs> lags_s;
  fitter.side_by_side(used, [&](std::size_t place) { lags_s[place] = fitter.lag_of(place, times.interval_s); });
  for (std::size_t rig = 1; rig < matchers.size(); ++rig) {
    const double change_s = lags_s[captures[rig].place] - lags_s[0];
    if (corrections_ns[rig] == 0 || !results[rig].is_used || !std::isfinite(change_s)) continue;
    measured_clocks[rig].sum_s += static_cast<double>(corrections_ns[rig]) / ns_per_s + change_s;
    ++measured_clocks[rig].count;
  }
}

/// The latest of the frames that a simulation explains, or of all if there are none, tells the time.
void RigMatcher::State::find_latest() noexcept {
  bool any_explained = false;
  for (std::size_t rig = 0; rig < matchers.size(); ++rig) any_explained = any_explained || is_explained(rig);
  latest_ns = std::numeric_limits<std::int64_t>::min();
  for (std::size_t rig = 0; rig < matchers.size(); ++rig)
    if (any_explained ? is_explained(rig) : is_indexed(rig)) latest_ns = std::max(latest_ns, captures[rig].stamp_ns);
}

bool RigMatcher::State::is_in_time(std::size_t rig) const noexcept {
  const bool is_late = seconds_between(captures[rig].stamp_ns, latest_ns) > most_apart * times.duration_s;
  return !(times.duration_s > 0) || (!is_late && !awaits_impact(rig));
}

/// Whether another rig saw the impact some time ago, so that the rig's clock seems to be behind. If it goes on like
/// that, something hides the deformation from it.
bool RigMatcher::State::awaits_impact(std::size_t rig) const noexcept {
  constexpr double least_intervals = 3, most_of_duration = 0.4;
  if (histories[rig].since_impact().variance > 0) return false;
  return std::ranges::any_of(histories, [this](const HistoryState& other) {
    const double passed_s = other.since_impact().mean_s;
    return passed_s > least_intervals * times.interval_s && passed_s < most_of_duration * times.duration_s;
  });
}

void RigMatcher::State::remember(MatchResult& result) noexcept {
  const bool is_evidence = result.status == Status::ok && fitter.is_explained() && !is_contradicted();
  EarlierShape shown = shape_shown(result.stamp_ns, fitter.estimate(), result.fit.error_90, result.fit.spread);
  if (fitter.verdict() != Verdict::unknown) joint_history.begin(result.stamp_ns, earliest_s());
  if (is_evidence) joint_history.add(shown, fitter.time());
  joint_history.write_time(result.stamp_ns, result.fit);
  for (std::size_t rig = 0; rig < matchers.size(); ++rig) {
    if (results[rig].is_used) histories[rig].see(fitter_of(rig));
    if (is_indexed(rig) && matchers[rig]->pose != nullptr) matchers[rig]->pose->write(results[rig]);
    poses_by_all[rig] = results[rig].is_used;
    shown.stamp_ns = difference(result.stamp_ns, corrections_ns[rig]);
    if (is_evidence && !awaits_impact(rig)) histories[rig].shapes.add(shown);
  }
}

void RigMatcher::State::publish(MatchResult& result) noexcept {
  Matcher::State& matcher = *matchers[lead];
  matcher.set_reference(result.stamp_ns, result);
  matcher.combine_coefficients(result.fit.estimate);
  matcher.publish_coefficients(result);
  matcher.publish_matches(fitter.matches(), result);
  const bool is_sure = result.status == Status::ok && !is_contradicted();
  if (is_sure || fitter.verdict() == Verdict::no_simulation_fits) result.verdict = fitter.verdict();
  const bool is_bounded = matchers.front()->has_baked_pose && fitter.is_explained() && !is_contradicted();
  result.channels = matcher.channels.of_fit(result.fit, fitter.is_hidden(), is_bounded);
}

MatchResult RigMatcher::match(std::span<const Frame> frames) noexcept {
  for (std::size_t rig = 0; rig < std::min(frames.size(), state_->matchers.size()); ++rig)
    if (!frames[rig].points.empty()) match_alone(rig, frames[rig]);
  return combine();
}
void RigMatcher::match_alone(std::size_t rig, const Frame& frame) noexcept {
  if (rig < state_->matchers.size()) state_->match_alone(rig, frame);
}
MatchResult RigMatcher::combine() noexcept { return state_->combine(); }
std::span<const RigResult> RigMatcher::rigs() const noexcept { return state_->results; }
void RigMatcher::use_threads(const RigThreads& threads) noexcept { state_->fitter.use(threads); }
void RigMatcher::fix_poses() noexcept {
  for (HistoryState& history : state_->histories) {
    history.estimates_pose = false;
    history.pose.reset();
  }
  state_->begin_capture_anew();
}
void RigMatcher::set_impact(std::int64_t stamp_ns) noexcept { state_->joint_history.clock.set_impact(stamp_ns); }
RigidTransform RigMatcher::pose_correction(std::size_t rig) const noexcept {
  return rig < state_->histories.size() ? state_->histories[rig].pose.transform() : identity_transform;
}
void RigMatcher::reset() noexcept {
  for (HistoryState& history : state_->histories) history.reset();
  state_->joint_history.reset();
  std::ranges::fill(state_->corrections_ns, 0);
  std::ranges::fill(state_->measured_clocks, State::ClockMeasurements{});
  std::ranges::fill(state_->poses_by_all, false);
  state_->begin_capture_anew();
}
const Model& RigMatcher::model() const noexcept { return state_->matchers.front()->model; }

}  // namespace lbea
