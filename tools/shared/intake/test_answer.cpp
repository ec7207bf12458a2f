#include "tools/shared/intake/test_answer.hpp"

#include "tools/shared/cli/formatted.hpp"
#include "tools/shared/intake/clock_times.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

// From the right pose, a rig covers 85 to 100 % of the undeformed component; 5 mm or 3 degrees off, 30 to 70 %.
constexpr float least_undeformed_coverage = 0.7f;
constexpr float sure = 0.9f;  // simulations are listed until their probabilities add up to this
constexpr std::size_t most_listed = 3;
constexpr float many_departed = 0.25f;  // sparks and dust are less

double percent(float share) { return 100.0 * static_cast<double>(share); }

std::string name_of(std::uint32_t simulation, std::span<const std::string> names) {
  return simulation < names.size() ? names[simulation] : std::to_string(simulation);
}

}  // namespace

bool UndeformedCoverage::add(const wire::WireResult& result) noexcept {
  if (wire::fate_of(result.status) != wire::Fate::matched) return false;
  const bool is_first = std::exchange(session_, result.session) != result.session;
  const bool is_initial = !result.matches.empty() && result.matches.front().sample.time_step == 0;
  if (!is_first && !is_initial) return false;
  latest_ = result.coverage;
  return true;
}

bool UndeformedCoverage::is_low() const noexcept { return latest_ && *latest_ < least_undeformed_coverage; }

std::string pose_warning(float coverage) {
  return formatted(
      "the frames cover only %.0f %% of the undeformed component: the pose or the model is wrong, or something hides "
      "it; check --pose, and refine it with lbea-register",
      percent(coverage));
}

std::optional<bool> TestDivision::begins(const wire::WireResult& result) noexcept {
  if (result.status == wire::WireStatus::end_of_stream && session_ == result.session) session_.reset();
  if (wire::fate_of(result.status) != wire::Fate::matched) return std::nullopt;
  return std::exchange(session_, result.session) != result.session;
}

void DepartedPoints::add(const wire::WireResult& result) noexcept {
  const std::optional<bool> begins = tests_.begins(result);
  if (!begins) return;
  if (*begins) first_ = result.points;
  const std::uint32_t departed = result.points.culled - std::min(first_.culled, result.points.culled);
  share_ = static_cast<float>(departed) / static_cast<float>(std::max(first_.used, 1u));
}

bool DepartedPoints::are_many() const noexcept { return share_ > many_departed; }

std::string departure_warning(float share) {
  return formatted(
      "more points than in the first frame are near no simulation, %.0f %% of the component's: a part may have torn "
      "off or moved away; the verdict does not consider these points",
      percent(share));
}

void CaptureTimes::add(const wire::WireResult& result) noexcept {
  constexpr double least_interval = 1e3;    // ns; no camera is as fast
  constexpr double longest_disorder = 1e6;  // ns
  const std::optional<bool> begins = tests_.begins(result);
  if (!begins) return;
  if (*begins) {
    intervals_ = wrong_ = 0;
    go_back_ = false;
  } else if (result.frame_id > latest_id_) {
    ++intervals_;
    const double interval = difference_ns(result.stamp_ns, latest_ns_);
    if (interval < least_interval) ++wrong_;
    go_back_ |= interval < -longest_disorder;
  } else {
    return;  // reordered
  }
  latest_id_ = result.frame_id;
  latest_ns_ = result.stamp_ns;
}

bool CaptureTimes::are_wrong() const noexcept {
  constexpr std::uint64_t fewest = 3;
  return intervals_ >= fewest && 2 * wrong_ > intervals_;
}

std::string capture_times_warning(bool go_back) {
  if (go_back)
    return "the stamps go back within the test: if these are two tests, end the stream after each, and reset the "
           "history";
  return "the stamps of most frames do not increase, or by less than 1 microsecond: are they capture times in ns? "
         "Matching uses the times of a test";
}

bool TestAnswer::add(const wire::WireResult& result) {
  has_ended_ |= result.status == wire::WireStatus::end_of_stream && session_ == result.session;
  const bool is_of_test = session_ == result.session && result.status != wire::WireStatus::duplicate;
  if (is_of_test && wire::fate_of(result.status) == wire::Fate::rejected) ++rejected_;
  if (wire::fate_of(result.status) != wire::Fate::matched) return false;
  if (has_ended_ || (session_ && session_ != result.session)) *this = {};
  session_ = result.session;
  ++matched_;
  departed_.add(result);
  times_.add(result);
  if (result.test.frames > 0) state_ = result.test;
  return undeformed_.add(result);
}

std::vector<std::string> TestAnswer::warnings() const {
  std::vector<std::string> warnings;
  if (undeformed_.is_low()) warnings.push_back(pose_warning(*undeformed_.latest()));
  if (departed_.are_many()) warnings.push_back(departure_warning(departed_.share()));
  if (times_.are_wrong() || times_.go_back()) warnings.push_back(capture_times_warning(!times_.are_wrong()));
  if (matched_ > 0 && rejected_ > matched_)
    warnings.push_back(std::to_string(rejected_) + " of " + std::to_string(matched_ + rejected_) +
                       " frames show no point near any simulation, or were rejected; the verdict does not consider "
                       "them");
  return warnings;
}

std::string TestAnswer::warning() const {
  const std::vector<std::string> all = warnings();
  return all.empty() ? "" : all.front();
}

std::string refusal_of_all(const wire::Counters& counters, std::string_view length_unit) {
  const std::uint64_t rejected = counters.sum(wire::Fate::rejected), empty = counters.of(wire::WireStatus::empty_frame);
  if (rejected == 0 || counters.sum(wire::Fate::matched) > 0) return "";
  if (empty < rejected)
    return "no frame was matched: " + std::to_string(rejected) + " were rejected, see their reasons";
  return std::to_string(rejected) + " frames came, and none of their points is near any simulation; are they in " +
         std::string(length_unit) + ", the model's unit, and is --pose right?";
}

std::string likely_simulations(const wire::WireTestState& state, std::span<const std::string> names) {
  if (state.verdict == wire::WireVerdict::no_simulation_fits) return "nearest: " + name_of(state.simulation, names);
  std::string text;
  float sum = 0;
  for (std::size_t i = 0; i < std::min(most_listed, state.simulations.size()) && sum < sure; ++i) {
    const wire::SimulationChance& chance = state.simulations[i];
    text += (i == 0 ? "" : " or ") + name_of(chance.simulation, names) +
            formatted(" (%.0f %%)", percent(chance.probability));
    sum += chance.probability;
  }
  return text;
}

std::string used_rigs(const wire::WireResult& result) {
  if (result.rigs.empty()) return "";
  std::string names;
  for (const wire::WireRigFrame& frame : result.rigs)
    if (frame.is_used) names += (names.empty() ? "" : ", ") + frame.rig;
  return names.empty() ? "none" : names;
}

std::string by_rigs(const wire::WireResult& result) { return result.rigs.empty() ? "" : " by " + used_rigs(result); }

std::string answer_text(const wire::WireTestState& state, std::span<const std::string> names) {
  if (state.frames == 0) return "no verdict; only method fit judges a test";
  const std::string likely = likely_simulations(state, names);
  const std::string misfit = formatted("misfit %.2f", static_cast<double>(state.misfit));
  if (state.verdict == wire::WireVerdict::no_simulation_fits) return "NO SIMULATION FITS, " + misfit + "; " + likely;
  if (state.verdict == wire::WireVerdict::matched) return "matched: " + likely + ", " + misfit;
  if (state.verdict == wire::WireVerdict::ambiguous) return "ambiguous: " + likely + ", " + misfit;
  return "no verdict yet; so far " + likely;
}

}  // namespace lbea::tool
