#include "tools/report/content/explanation.hpp"

#include "runtime/src/track/tracker.hpp"
#include "tools/shared/text/formatted.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

std::string misfit_text(const TestFacts& facts, const wire::WireTestState& state) {
  std::string text = formatted("misfit %.2f, where 1 is expected of a run that is not in the ensemble",
                               static_cast<double>(state.misfit));
  if (std::isfinite(facts.test_limit)) text += formatted(" and %.2f is the limit", facts.test_limit);
  return text;
}

bool is_sure_of_simulation(const wire::WireTestState& state) {
  return !state.simulations.empty() && state.simulations.front().probability >= certain_branch;
}

Explanation explain_match(const TestFacts& facts, const wire::WireTestState& state) {
  Explanation answer{Explanation::Tone::good, "A simulation fits", {}, {}, {}, "yes"};
  const std::string likely = likely_simulations(state, facts.names);
  if (is_sure_of_simulation(state)) {
    answer.headline = "The test follows simulation " + likely + ".";
    answer.action = "Use this simulation and the estimate, also where no camera looked.";
  } else {
    answer.headline =
        "The ensemble explains the test; it is not certain which of several similar simulations it follows: " + likely +
        ".";
    answer.action = "Use the estimate, which lies between these simulations; do not report a single one of them.";
  }
  answer.meaning =
      "The measured surface differs from the best shape no more than simulations of the ensemble differ "
      "from each other: " +
      misfit_text(facts, state) + ".";
  answer.action += " Before relying on a detail, look at the regions that are explained worst.";
  return answer;
}

Explanation explain_ambiguity(const TestFacts& facts, const wire::WireTestState& state) {
  return {
      Explanation::Tone::open,
      "Several simulations fit",
      "Simulations with clearly different shapes explain the test about equally well: " +
          likely_simulations(state, facts.names) + ".",
      "What the sensor saw does not decide between deformation branches: none has 90 % probability (" +
          misfit_text(facts, state) + ").",
      "Do not name one simulation. The curves of the probabilities show when the ambiguity began; a view of more of "
      "the surface, or later frames, may resolve it.",
      "several do"};
}

Explanation explain_misfit(const TestFacts& facts, const wire::WireTestState& state) {
  return {Explanation::Tone::bad,
          "No simulation fits",
          "No simulation of this ensemble fits the test; " + likely_simulations(state, facts.names) + ".",
          "The measured surface differs from every simulation by more than simulations differ from each other: " +
              misfit_text(facts, state) + ". Probabilities then mean nothing.",
          "First rule out a wrong pose, unit or component: see the warnings, and the coverage of the first frames. If "
          "the measurement is right, this behavior is missing in the ensemble: add runs that cover what the worst "
          "regions show.",
          "no"};
}

Explanation explain_nothing(const TestFacts& facts, const wire::WireTestState& state) {
  Explanation answer{Explanation::Tone::open, "No verdict", {}, {}, {}, "not known"};
  if (state.frames == 0) {
    const bool is_fit = facts.method == "fit";
    answer.headline =
        is_fit ? "There is no verdict: no frame showed enough of the component."
               : "There is no verdict: the frames were matched by " + facts.method + ", which gives distances only.";
    answer.meaning = "Only the method fit judges whether a simulation fits.";
    answer.action = is_fit ? "Check pose and field of view; low coverage has the same effect."
                           : "Match the recording again: lbea-replay RECORDING --model MODEL --method fit.";
    return answer;
  }
  const bool is_short = state.frames < frames_for_verdict;
  answer.headline = "There is no verdict; likeliest: " + likely_simulations(state, facts.names) + ".";
  answer.meaning = is_short ? "Only " + std::to_string(state.frames) + " frames tell anything; a verdict needs " +
                                  std::to_string(frames_for_verdict) + "."
                            : "Too little of the component was visible, or the ensemble has a single simulation.";
  answer.action = is_short ? "Record more frames of the test." : "Check pose and field of view.";
  return answer;
}

}  // namespace

Explanation explain(const TestFacts& facts) {
  if (facts.record == nullptr)
    return {Explanation::Tone::bad,
            "Nothing was matched",
            facts.refusal.empty() ? "The recording has no matched frame." : "No frame was matched.",
            facts.refusal.empty() ? "There is nothing to judge." : facts.refusal + ".",
            "Check the pose, the unit of the points, the field of view, and the reasons in the accounts below.",
            "not known"};
  const wire::WireTestState& state = facts.record->answer().state();
  if (state.frames == 0) return explain_nothing(facts, state);
  switch (state.verdict) {
    case wire::WireVerdict::matched:
      return explain_match(facts, state);
    case wire::WireVerdict::ambiguous:
      return explain_ambiguity(facts, state);
    case wire::WireVerdict::no_simulation_fits:
      return explain_misfit(facts, state);
    default:
      return explain_nothing(facts, state);
  }
}

void add_doubt(Explanation& explanation, const std::string& of) {
  explanation.action = "First read the warnings" + (of.empty() ? "" : " of " + of) +
                       " below: they put this verdict in doubt. " + explanation.action;
}

Likeliest likeliest_branch(const wire::WireTestState& state) {
  if (state.branches.empty()) return {};
  const auto best = std::ranges::max_element(state.branches);
  return {static_cast<std::uint32_t>(best - state.branches.begin()), double{*best}, state.branches.size()};
}

std::string simulation_name(std::span<const std::string> names, std::uint32_t simulation) {
  return simulation < names.size() ? names[simulation] : "simulation " + std::to_string(simulation);
}

}  // namespace lbea::tool
