// The verdict of a test with several components.
#include "tests/report/studied_plates.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::test;
using namespace lbea::tool;

namespace {

TestReport component_with(const std::string& name, std::uint32_t simulation, Explanation::Tone tone,
                          const std::string& word) {
  std::vector<wire::WireResult> frames = frames_of(model(), simulation);
  for (wire::WireResult& frame : frames) {
    frame.test.frames = 9;
    frame.test.verdict = wire::WireVerdict::matched;
    frame.test.simulations = {{simulation, 1.0f}};
  }
  TestReport report = report_of(plates(), frames);
  report.component = name;
  report.explanation.tone = tone;
  report.explanation.word = word;
  return report;
}

Explanation together(std::vector<TestReport> components) { return explain_together(components); }

using Tone = Explanation::Tone;

}  // namespace

TEST_CASE("a test is explained when each component is; its verdict is the worst one, and names all") {
  const TestReport hood = component_with("hood", 1, Tone::good, "A simulation fits"),
                   fender = component_with("fender", 1, Tone::good, "A simulation fits"),
                   door = component_with("door", 2, Tone::good, "A simulation fits"),
                   open = component_with("roof", 1, Tone::open, "Several simulations fit"),
                   bad = component_with("sill", 1, Tone::bad, "No simulation fits");
  const Explanation same = together({hood, fender}), own = together({hood, door});
  CHECK(same.tone == Tone::good);
  CHECK(same.headline == "All components follow plate_1 (100 %).");
  CHECK(own.tone == Tone::good);
  CHECK(own.headline == "Each component follows its own simulation: hood plate_1 (100 %); door plate_2 (100 %).");
  // Regression: the verdict of the test was without doubt where the page of lbea-monitor showed a warning.
  TestReport doubtful = door;
  doubtful.warnings = {"the pose is wrong"};
  CHECK(own.action.find("First read the warnings") == std::string::npos);
  CHECK(together({hood, doubtful}).action.find("First read the warnings of door below") == 0);
  const Explanation undecided = together({hood, open}), none = together({bad, open, hood});
  CHECK(undecided.tone == Tone::open);
  CHECK(undecided.headline == "hood: A simulation fits; roof: Several simulations fit.");
  CHECK(undecided.answer == "not known");
  CHECK(none.tone == Tone::bad);
  CHECK(none.headline == "sill: No simulation fits; roof: Several simulations fit; hood: A simulation fits.");
  CHECK(none.answer == "no");
}
