#include "tools/shared/answer/test_answer.hpp"

#include "tools/shared/answer/clock_times.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

constexpr float sure = 0.9f;  // simulations are listed until their probabilities add up to this
constexpr std::size_t most_listed = 3;

double percent(float share) { return 100.0 * static_cast<double>(share); }

std::string name_of(std::uint32_t simulation, std::span<const std::string> names) {
  return simulation < names.size() ? names[simulation] : std::to_string(simulation);
}

}  // namespace

bool TestAnswer::add(const wire::WireResult& result) {
  has_ended_ |= result.status == wire::WireStatus::end_of_stream && session_ == result.session;
  const bool is_of_test = session_ == result.session && result.status != wire::WireStatus::duplicate;
  if (is_of_test && wire::fate_of(result.status) == wire::Fate::rejected) ++rejected_;
  if (has_ended_ && session_ == result.session && result.status == wire::WireStatus::duplicate) ++repeated_;
  if (wire::fate_of(result.status) != wire::Fate::matched) {
    departed_.add(result);
    return false;
  }
  if (has_ended_ || (session_ && session_ != result.session)) *this = {};
  session_ = result.session;
  ++matched_;
  departed_.add(result);
  times_.add(result);
  rigs_.add(result);
  if (result.test.frames > 0) state_ = result.test;
  return undeformed_.add(result);
}

std::vector<std::string> TestAnswer::warnings() const {
  std::vector<std::string> warnings;
  if (undeformed_.is_low()) warnings.push_back(pose_warning(*undeformed_.latest(), undeformed_.rig()));
  if (departed_.are_many()) warnings.push_back(departure_warning(departed_.share()));
  if (times_.problem() != CaptureTimes::Problem::none) warnings.push_back(capture_times_warning(times_.problem()));
  if (rigs_.contradict()) warnings.push_back(contradiction_warning());
  if (const auto unused = rigs_.unused()) warnings.push_back(unused_rig_warning(*unused));
  if (matched_ > 0 && rejected_ > matched_)
    warnings.push_back(std::to_string(rejected_) + " of " + std::to_string(matched_ + rejected_) +
                       " frames show no point near any simulation, or were rejected; the verdict does not consider "
                       "them");
  if (repeated_ > 0)
    warnings.push_back(std::to_string(repeated_) +
                       " frames after the end of the stream were refused because their ids had been used before it: "
                       "go on with the ids, or begin another session");
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
  if (state.frames == 0)
    return "no verdict: no frame shows enough of the component or has enough points, or the method is not fit";
  const std::string likely = likely_simulations(state, names);
  const std::string misfit = formatted("misfit %.2f", static_cast<double>(state.misfit));
  if (state.verdict == wire::WireVerdict::no_simulation_fits) return "NO SIMULATION FITS, " + misfit + "; " + likely;
  if (state.verdict == wire::WireVerdict::matched) return "matched: " + likely + ", " + misfit;
  if (state.verdict == wire::WireVerdict::ambiguous) return "ambiguous: " + likely + ", " + misfit;
  return "no verdict; likeliest: " + likely;
}

}  // namespace lbea::tool
