// What lbea-replay --against calls a difference.
#include "tools/replay/comparison.hpp"
#include "tools/replay/report.hpp"

#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

constexpr std::uint64_t frames = 3;

/// The displacement grows from 0 to its peak of -200 mm.
wire::WireResult result_of(std::uint64_t frame) {
  wire::WireResult result;
  result.session = 1;
  result.frame_id = frame;
  result.receive_ns = static_cast<std::int64_t>(frame + 1);
  result.matches = {{{0, static_cast<std::uint32_t>(frame)}, "run", 0, 1.0f}};
  const float value = -100 * static_cast<float>(frame);
  result.channels = {{{value, 2}, "end x", "mm"}, {{1, std::nanf("")}, "gap", "mm"}};
  return result;
}

struct Differences {
  ComparisonTally tally;
  std::string text;
};

/// Compares the recorded frames with those after a change.
Differences differences(double tolerance, const std::function<void(wire::WireResult&)>& change) {
  const TemporaryFolder folder;
  ResultsFile file(folder / "results.mcap", {});
  for (std::uint64_t frame = 0; frame < frames; ++frame) file.add(result_of(frame));
  file.finish();
  RecordedRun run(folder / "results.mcap");
  const FrameFates fates(run);
  ResultComparison comparison(run, fates, tolerance, false);
  Differences found;
  for (std::uint64_t frame = 0; frame < frames; ++frame) {
    wire::WireResult now = result_of(frame);
    change(now);
    found.text += comparison.compare(now).value_or("");
  }
  found.tally = comparison.tally();
  return found;
}

}  // namespace

TEST_CASE("the same channels are no difference, also without a bound") {
  for (const double tolerance : {0.0, 0.01}) {
    const Differences found = differences(tolerance, [](wire::WireResult&) {});
    CHECK(found.tally.same == frames);
    CHECK_MESSAGE(found.text.empty(), found.text);
  }
}

TEST_CASE("a channel may differ by the tolerance times its peak, also near zero") {
  const auto moved = [](float by) { return [by](wire::WireResult& now) { now.channels[0].value += by; }; };
  CHECK(differences(0, moved(0.001f)).tally.other_channels == frames);
  CHECK(differences(0.01, moved(1.9f)).tally.same == frames);
  const Differences more = differences(0.01, moved(2.1f));
  CHECK(more.tally.different == frames);
  CHECK(more.tally.other_channels == frames);
  CHECK(more.text.find("channel \"end x\" then -100.000000 +- 2.000000 mm, now -97.9") != std::string::npos);
}

TEST_CASE("another bound, unit or name, and a channel that comes or goes, are differences") {
  const auto check = [](const std::function<void(wire::WireResult&)>& change, const char* words) {
    for (const double tolerance : {0.0, 0.01}) {
      const Differences found = differences(tolerance, change);
      CHECK(found.tally.other_channels == frames);
      CHECK_FALSE(found.tally.is_same());
      CHECK_MESSAGE(found.text.find(words) != std::string::npos, found.text);
    }
  };
  check([](wire::WireResult& now) { now.channels[0].bound_90 = 5; }, "channel \"end x\" then");
  check([](wire::WireResult& now) { now.channels[1].bound_90 = 0; }, "channel \"gap\" then");
  check([](wire::WireResult& now) { now.channels[1].value = std::nanf(""); }, "channel \"gap\" then");
  check([](wire::WireResult& now) { now.channels[0].end = {50, 1}; }, "at the end 50.000000 +- 1.000000");
  check([](wire::WireResult& now) { now.channels[0].unit = "m"; }, "channel \"end x\" then");
  check([](wire::WireResult& now) { now.channels[0].name = "end y"; }, "channel \"end y\" is not recorded");
  check([](wire::WireResult& now) { now.channels.pop_back(); }, "channel \"gap\" is missing now");
  check([](wire::WireResult& now) { now.channels.push_back({{1, 1}, "more", ""}); }, "\"more\" is not recorded");
}
