// The answer of a test, as text and in the report of lbea-eval live.
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tests/support/test_data.hpp"
#include "tools/eval/live.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;
using wire::WireResult;
using wire::WireStatus;
using wire::WireVerdict;

namespace {

const std::vector<std::string> plate_names{"plate_0", "plate_1", "plate_2", "plate_3"};

/// A frame that matches alone, in a test with this verdict.
WireResult frame(WireVerdict test_verdict, std::vector<wire::SimulationChance> chances, float coverage = 0.95f,
                 std::uint32_t time_step = 3) {
  WireResult result;
  result.session = 1;
  result.verdict = WireVerdict::matched;
  result.coverage = coverage;
  result.matches = {{{chances.front().simulation, time_step}, "plate", 0.003, 1.5f}};
  result.test.frames = 20;
  result.test.simulation = chances.front().simulation;
  result.test.simulations = std::move(chances);
  result.test.misfit = 2.17f;
  result.test.verdict = test_verdict;
  return result;
}

/// The capture of two rigs at this ms, which simulations explain one by one.
WireResult capture_of_two_rigs(std::uint64_t ms) {
  WireResult result = frame(WireVerdict::matched, {{2, 1.0f}});
  result.frame_id = ms;
  result.stamp_ns = static_cast<std::int64_t>(ms) * 1'000'000;
  for (const char* name : {"left", "right"}) {
    wire::WireRigFrame& rig = result.rigs.emplace_back();
    rig.rig = name;
    rig.status = WireStatus::ok;
    rig.verdict = WireVerdict::matched;
    rig.is_used = true;
    rig.coverage = result.coverage;
  }
  return result;
}

/// A matched frame of this session, without a state of the test, is the first of another test.
void check_begins_another(TestAnswer& answer, std::uint64_t session) {
  WireResult first;
  first.session = session;
  first.coverage = 0.9f;
  answer.add(first);
  CHECK(answer.state().frames == 0);
}

}  // namespace

TEST_CASE("the answer names the verdict, and as many simulations as are needed to be sure") {
  const auto text = [](WireVerdict verdict, const std::vector<wire::SimulationChance>& chances) {
    return answer_text(frame(verdict, chances).test, plate_names);
  };
  CHECK(text(WireVerdict::matched, {{2, 0.997f}, {1, 0.003f}}) == "matched: plate_2 (100 %), misfit 2.17");
  CHECK(text(WireVerdict::ambiguous, {{2, 0.55f}, {1, 0.4f}, {0, 0.05f}}) ==
        "ambiguous: plate_2 (55 %) or plate_1 (40 %), misfit 2.17");
  CHECK(text(WireVerdict::matched, {{0, 0.3f}, {1, 0.3f}, {2, 0.2f}, {3, 0.2f}}) ==
        "matched: plate_0 (30 %) or plate_1 (30 %) or plate_2 (20 %), misfit 2.17");
  // Probabilities compare the simulations with each other; they do not say that one fits.
  CHECK(text(WireVerdict::no_simulation_fits, {{2, 1.0f}}) == "NO SIMULATION FITS, misfit 2.17; nearest: plate_2");
  CHECK(text(WireVerdict::unknown, {{9, 0.95f}}) == "no verdict; likeliest: 9 (95 %)");
  CHECK(answer_text({}, plate_names) ==
        "no verdict: no frame shows enough of the component or has enough points, or the method is not fit");
}

TEST_CASE("a result of several rigs names those that it rests on") {
  WireResult result;
  CHECK(used_rigs(result).empty());
  for (const char* name : {"left", "right"}) result.rigs.emplace_back().rig = name;
  CHECK(used_rigs(result) == "none");
  result.rigs[1].is_used = true;
  CHECK(used_rigs(result) == "right");
  result.rigs[0].is_used = true;
  CHECK(used_rigs(result) == "left, right");
}

TEST_CASE("the answer outlasts refused and missed frames, and ends with the next test") {
  TestAnswer answer;
  answer.add(frame(WireVerdict::no_simulation_fits, {{2, 1.0f}}));
  WireResult missed;
  missed.session = 1;
  missed.status = WireStatus::missed;
  CHECK(!answer.add(missed));
  CHECK(answer.state().verdict == WireVerdict::no_simulation_fits);
  check_begins_another(answer, 2);
}

// Regression: the second test of a sender kept the answer of the first.
TEST_CASE("the end of the stream ends the test; the session's next frame begins another") {
  TestAnswer answer;
  answer.add(frame(WireVerdict::no_simulation_fits, {{2, 1.0f}}));
  WireResult end;
  end.session = 1;
  end.status = WireStatus::end_of_stream;
  answer.add(end);
  CHECK(answer.state().verdict == WireVerdict::no_simulation_fits);
  check_begins_another(answer, 1);
}

// Regression: 30 of 36 frames were empty, and the test was said to be matched, without a word about them.
TEST_CASE("a test of which most frames were rejected is answered with a warning") {
  TestAnswer answer;
  WireResult empty;
  empty.session = 1;
  empty.status = WireStatus::empty_frame;
  for (int i = 0; i < 3; ++i) {
    answer.add(frame(WireVerdict::matched, {{2, 1.0f}}));
    answer.add(empty);
    CHECK(answer.warning().empty());
  }
  answer.add(empty);
  CHECK(contains(answer.warning(), "4 of 7 frames"));
}

// Regression: stamps in ms, taken as ns, and stamps of 0 gave an answer without a word about them.
TEST_CASE("stamps that cannot be capture times in ns give a warning") {
  const auto warning = [](const std::vector<std::int64_t>& stamps) {
    TestAnswer answer;
    for (std::size_t i = 0; i < stamps.size(); ++i) {
      WireResult result = frame(WireVerdict::matched, {{2, 1.0f}});
      result.frame_id = i;
      result.stamp_ns = stamps[i];
      answer.add(result);
    }
    return answer.warning();
  };
  constexpr std::int64_t start = 1'700'000'000'000;
  CHECK(contains(warning({start, start + 1, start + 2, start + 3}), "in ns?"));         // ms
  CHECK(contains(warning({start, start + 500, start + 999, start + 1499}), "in ns?"));  // us
  CHECK(contains(warning({0, 0, 0, 0}), "in ns?"));
  CHECK(contains(warning({INT64_MAX, INT64_MIN, 0, -5'000}), "in ns?"));
  CHECK(warning({start, start + 1'000, start + 2'000, start + 3'000}).empty());  // a million frames per second
  CHECK(warning({start, start + 1'000'000, start + 999'000, start + 2'000'000}).empty());  // one exchanged stamp
  // Regression: the same test twice without an end between was one test.
  CHECK(contains(warning({start, start + 1'000'000, start + 5'000'000, start + 500'000, start + 2'000'000}),
                 "the stamps go back within the test"));
  CHECK(warning({start, start, start}).empty());  // too few to tell
}

// Regression: velocities and forecasts were several times too high, without a word about the stamps.
TEST_CASE("stamps at another pace than the shapes, gaps and repeated ids give a warning") {
  const auto warning = [](double pace, std::int64_t gap_ns = 0) {
    TestAnswer answer;
    for (std::uint64_t i = 0; i < 20; ++i) {
      WireResult result = frame(WireVerdict::matched, {{2, 1.0f}});
      result.frame_id = i;
      result.matches.front().time_s = 1e-3 * static_cast<double>(i);
      result.stamp_ns = static_cast<std::int64_t>(1e6 * static_cast<double>(i) / pace) + (i > 10 ? gap_ns : 0);
      answer.add(result);
    }
    return answer.warning();
  };
  for (const double pace : {0.6, 1.0, 1.5}) CHECK(warning(pace).empty());
  for (const double pace : {2.0, 10.0, 900.0}) CHECK(contains(warning(pace), "much faster than the stamps"));
  for (const double pace : {0.4, 0.01}) CHECK(contains(warning(pace), "much more slowly than the stamps"));
  CHECK(contains(warning(1, 60'000'000'000), "gap of more than 10 s"));

  TestAnswer answer;
  WireResult result = frame(WireVerdict::matched, {{2, 1.0f}});
  answer.add(result);
  result.status = WireStatus::end_of_stream;
  answer.add(result);
  CHECK(answer.warning().empty());
  result.status = WireStatus::duplicate;
  for (int i = 0; i < 3; ++i) answer.add(result);
  CHECK(contains(answer.warning(), "3 frames after the end of the stream"));
}

// Regression: the clock's correction itself was reported as stamps that go back.
TEST_CASE("the frames that wait while a rig's clock is corrected give no warning") {
  for (const std::int64_t correction_ns : {0, -5'000'000}) {
    TestAnswer answer;
    std::uint64_t id = 0;
    for (const std::uint64_t ms : {0u, 5u, 1u, 6u}) {
      WireResult result = capture_of_two_rigs(ms);
      result.frame_id = id++;
      result.rigs[1].clock_correction_ns = correction_ns;
      answer.add(result);
    }
    CHECK(answer.warning().empty() == (correction_ns != 0));
  }
}

// Regression: a rig whose frames showed something else was counted as matched, and nothing was said.
TEST_CASE("a rig that the results do not rest on gives a warning") {
  const auto warning = [](std::size_t used_until) {
    TestAnswer answer;
    for (std::size_t i = 0; i < 12; ++i) {
      WireResult result = capture_of_two_rigs(i);
      result.rigs[1].is_used = i < used_until;
      answer.add(result);
    }
    return answer.warning();
  };
  CHECK(warning(6).empty());
  CHECK(contains(warning(3), "rig right: the results rest on 3 of its 12 frames"));
}

// The other rig covers the component, and both were said to rest on none of the second one's frames.
TEST_CASE("a rig that is used and covers little of the undeformed component gives a warning of its pose") {
  TestAnswer answer;
  for (std::size_t i = 0; i < 12; ++i) {
    WireResult result = capture_of_two_rigs(i);
    result.rigs[1].coverage = 0.2f;
    result.rigs[1].status = WireStatus::low_coverage;
    answer.add(result);
  }
  REQUIRE(answer.warnings().size() == 1);
  CHECK(contains(answer.warning(), "rig right: the frames cover only 20 % of the undeformed component"));
  CHECK(contains(answer.warning(), "check --pose right"));
}

// A rig that sent meters was ignored for the whole test, and nothing was said.
TEST_CASE("a rig whose points are near no simulation gives a warning, one without frames does not") {
  for (const std::uint32_t points : {0u, 20'000u}) {
    TestAnswer answer;
    for (std::size_t i = 0; i < 12; ++i) {
      WireResult result = capture_of_two_rigs(i);
      result.rigs[1].status = WireStatus::empty_frame;
      result.rigs[1].points = {.received = points, .culled = points};
      result.rigs[1].is_used = false;
      answer.add(result);
    }
    CHECK(contains(answer.warning(), "rig right: the results rest on 0 of its 12 frames") == (points > 0));
  }
}

// Regression: rigs that saw different tests gave "matched" with 100 %.
TEST_CASE("rigs whose frames are explained one by one, but not together, give a warning") {
  TestAnswer answer;
  for (std::size_t i = 0; i < 12; ++i) {
    WireResult result = capture_of_two_rigs(i);
    if (i >= 8) result.verdict = WireVerdict::unknown;
    answer.add(result);
    CHECK(answer.warning().empty() == (i < 11));
  }
  CHECK(contains(answer.warning(), "the rigs see different shapes"));
}

// Regression: a rail whose front half moved away was matched with 100 %, and half of its points were left out silently.
TEST_CASE("a part that leaves the space of the simulations gives a warning") {
  TestAnswer answer;
  WireResult result = frame(WireVerdict::matched, {{2, 1.0f}});
  result.points = {.received = 60'000, .culled = 20'000, .used = 40'000};  // 20,000 of the background
  answer.add(result);
  result.points = {.received = 55'000, .culled = 25'000, .used = 30'000};
  answer.add(result);
  CHECK(answer.warning().empty());
  result.points = {.received = 60'000, .culled = 40'000, .used = 20'000};
  answer.add(result);
  CHECK(contains(answer.warning(), "near no simulation, 50 % of the component's"));
}

TEST_CASE("of several components, only the one warns that has lost the points") {
  TestAnswer hood, fender;
  const auto add = [](TestAnswer& answer, const char* component, std::uint32_t used, std::uint32_t near_none) {
    WireResult result = frame(WireVerdict::matched, {{2, 1.0f}});
    result.component = component;
    result.points = {.received = 60'000, .culled = 60'000 - used, .used = used};
    result.points_near_none = near_none;
    answer.add(result);
  };
  add(hood, "hood", 40'000, 10'000);
  add(fender, "fender", 10'000, 10'000);
  // Points of the fender move out of the hood's space, into the fender's.
  add(hood, "hood", 25'000, 10'000);
  add(fender, "fender", 25'000, 10'000);
  CHECK(hood.warning().empty());
  CHECK(fender.warning().empty());
  // The hood is hidden, and there are sparks.
  add(hood, "hood", 10'000, 15'000);
  add(fender, "fender", 10'000, 15'000);
  CHECK(hood.warning().empty());
  CHECK(fender.warning().empty());
  TestAnswer gone = fender;
  add(hood, "hood", 20'000, 30'000);
  add(fender, "fender", 10'000, 30'000);
  CHECK(contains(hood.warning(), "near no simulation, 50 % of the component's"));
  CHECK(fender.warning().empty());
  WireResult empty = frame(WireVerdict::refused, {{2, 1.0f}});
  empty.status = WireStatus::empty_frame;
  empty.component = "fender";
  empty.points = {.received = 60'000, .culled = 60'000, .used = 0};
  empty.points_near_none = 20'000;
  gone.add(empty);
  CHECK(contains(gone.warning(), "near no simulation, 100 % of the component's"));
}

// Regression: `only method fit judges a test`.
TEST_CASE("without results, the report says that none came") {
  const AlignedBytes bytes = bent_plates_model();
  CHECK(contains(table_summary({}, Model::view(bytes.span())), "test so far: no results came"));
}

// Regression: meshes had the times of their samples, which ParaView sorts: frames were reordered or shown as one.
TEST_CASE("the meshes of a test have the times of the frames since the first one") {
  LiveSummary summary;
  for (const std::int64_t stamp_ns : {1'700'000'000'000'000'000, 1'700'000'000'001'000'000, 1'699'999'999'999'500'000})
    summary.rows.emplace_back().result.stamp_ns = stamp_ns;
  CHECK(summary.seconds_since_first(summary.rows[0]) == 0);
  CHECK(summary.seconds_since_first(summary.rows[1]) == doctest::Approx(1e-3));
  CHECK(summary.seconds_since_first(summary.rows[2]) == doctest::Approx(-0.5e-3));
}

// Regression: with a wrong pose, 34 % of the undeformed component were covered, and nothing was said.
TEST_CASE("low coverage of the undeformed component gives a warning that names lbea-register, until it is covered") {
  TestAnswer answer;
  CHECK(answer.warning().empty());
  CHECK(answer.add(frame(WireVerdict::unknown, {{0, 1.0f}}, 0.34f, 2)));  // the first frame, whatever it matches
  CHECK(contains(answer.warning(), "34 % of the undeformed component"));
  CHECK(contains(answer.warning(), "lbea-register"));
  CHECK(!answer.add(frame(WireVerdict::unknown, {{0, 1.0f}}, 0.95f, 2)));
  CHECK(!answer.warning().empty());
  CHECK(answer.add(frame(WireVerdict::unknown, {{0, 1.0f}}, 0.95f, 0)));
  CHECK(answer.warning().empty());
  // A crushed component hides parts of itself.
  answer.add(frame(WireVerdict::unknown, {{0, 1.0f}}, 0.34f, 9));
  CHECK(answer.warning().empty());
}

// Regression: the report ended with the most likely simulation, and never said that none fits.
TEST_CASE("the report of lbea-eval live begins with the answer of the test, also as JSON") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  const Model model = Model::open(folder / "plates.lbea");
  LiveSummary summary;
  summary.complete = true;
  for (int i = 0; i < 5; ++i) {
    LiveRow row;
    row.result = frame(WireVerdict::no_simulation_fits, {{2, 1.0f}}, 0.34f);
    row.on_path = {2, 5};
    summary.answer.add(row.result);
    summary.rows.push_back(row);
  }
  const std::string text = table_summary(summary, model);
  CAPTURE(text);
  CHECK(text.starts_with("test: NO SIMULATION FITS, misfit 2.17; nearest: plate_2\nwarning: "));
  CHECK(contains(text, "lbea-register"));
  CHECK(contains(text, "nearest path of the whole test: ends at plate_2, time step 5"));
  const auto json = nlohmann::json::parse(to_json(summary, model));
  CHECK(json["test"]["verdict"] == "no_simulation_fits");
  CHECK(json["test"]["misfit"].get<double>() == doctest::Approx(2.17));
  CHECK(json["test"]["simulations"][0]["simulation"] == "plate_2");
  CHECK(json["test"]["undeformed_coverage"].get<double>() == doctest::Approx(0.34));
  CHECK(json["frames"][4]["verdict"] == "matched");
  CHECK(contains(table_line(summary.rows.back()), "matched"));
}
