// What a test of several components says as a whole.
#include "tools/report/content/test_report.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

using Tone = Explanation::Tone;

/// "hood: A simulation fits; fender: No simulation fits"
std::string words_of(std::span<const TestReport> components) {
  std::string text;
  for (const TestReport& report : components)
    text += (text.empty() ? "" : "; ") + report.component + ": " + report.explanation.word;
  return text;
}

/// "hood, fender": the components with warnings.
std::string warned(std::span<const TestReport> components) {
  std::string names;
  for (const TestReport& report : components)
    if (!report.warnings.empty()) names += (names.empty() ? "" : ", ") + report.component;
  return names;
}

Explanation explain_matches(std::span<const TestReport> components) {
  const auto likely = [](const TestReport& report) { return likely_simulations(report.state(), report.names); };
  const std::string first = likely(components.front());
  Explanation answer{Tone::good, "A simulation fits each component", {}, {}, {}, "yes"};
  if (std::ranges::all_of(components, [&](const TestReport& report) { return likely(report) == first; })) {
    answer.headline = "All components follow " + first + ".";
  } else {
    answer.headline = "Each component follows its own simulation: ";
    for (const TestReport& report : components)
      answer.headline += (&report == &components.front() ? "" : "; ") + report.component + " " + likely(report);
    answer.headline += ".";
  }
  answer.meaning =
      "The measured surface of each component differs from its best shape no more than simulations of the ensemble "
      "differ from each other.";
  answer.action = "Use the estimates, also where no camera looked; what to do is said of each component below.";
  if (const std::string names = warned(components); !names.empty()) add_doubt(answer, names);
  return answer;
}

}  // namespace

Explanation explain_together(std::span<const TestReport> components) {
  Tone worst = Tone::good;
  for (const TestReport& report : components) worst = std::max(worst, report.explanation.tone);
  if (worst == Tone::good) return explain_matches(components);
  const std::string headline = words_of(components) + ".";
  if (worst == Tone::open)
    return {worst,
            "Not every component has a clear verdict",
            headline,
            "The test is explained only where a simulation fits; of the other components the frames do not tell it.",
            "Look at the components without a clear verdict below.",
            "not known"};
  return {worst,
          "No simulation fits the whole test",
          headline,
          "At least one component differs from every simulation, or was not seen. A simulation that fits another "
          "component does not explain this test.",
          "Look at the components that no simulation fits below.",
          "no"};
}

}  // namespace lbea::tool
