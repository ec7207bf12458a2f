// Ratings of quantities of interest: which simulation, from which impact, and why there is none.
#include "tests/report/studied_plates.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

void set_state(std::vector<wire::WireResult>& frames, std::uint32_t simulation) {
  for (wire::WireResult& frame : frames) {
    frame.test.frames = frame.frame_id + 1;
    frame.test.simulation = simulation;
    frame.test.verdict = wire::WireVerdict::matched;
  }
}

using Json = nlohmann::json;

}  // namespace

TEST_CASE("the simulation that the test shows is rated excellent, whatever the camera's clock") {
  for (const double begin_s : {-3.0, 0.0, 1.7e9}) {
    const TestReport report = report_of(plates(), frames_of(model(), 2, begin_s));
    CHECK(report.channels.simulation == 2u);
    REQUIRE(report.channels.impact_s);
    CHECK(*report.channels.impact_s == doctest::Approx(0.002).epsilon(1e-3));  // stamps near 1.7e18 ns are exact to 256
    REQUIRE(report.channels.channels.size() == 2);
    for (const StudiedChannel& channel : report.channels.channels) {
      REQUIRE(channel.rating);
      CHECK(channel.rating->overall > 0.999);
      CHECK(channel.rating->shift.values == 0);
      CHECK(channel.simulation.begin_s() == 0);
      CHECK(channel.simulation.end_s() == doctest::Approx(0.02));
      CHECK(channel.test.end_s() == doctest::Approx(0.02).epsilon(1e-3));
    }
  }
}

TEST_CASE("the verdict's simulation is rated, not that of the last frame") {
  std::vector<wire::WireResult> frames = frames_of(model(), 2);
  set_state(frames, 0);
  const TestReport report = report_of(plates(), frames);
  CHECK(report.channels.simulation == 0u);
  for (std::size_t c = 0; c < 2; ++c) {
    const StudiedChannel& channel = report.channels.channels[c];
    REQUIRE(channel.rating);
    // The rating itself, from the definitions: both signals every 0.1 ms from 0 to 20 ms.
    const TimeGrid grid{0, 1e-4, 201};
    const std::vector<double> test = resampled(channel.test, grid), alone = resampled(channel.simulation, grid);
    CHECK(channel.rating->overall == doctest::Approx(rate({test, alone}).overall).epsilon(1e-6));
    CHECK(channel.rating->overall < 0.9);
  }
}

TEST_CASE("the test's clock tells the impact before the matches do") {
  std::vector<wire::WireResult> frames = frames_of(model(), 1);
  for (wire::WireResult& frame : frames) {
    frame.fit.candidates = {{frame.matches[0].sample, 0.1f}};
    frame.fit.test_time = static_cast<float>(0.0005 * static_cast<double>(frame.frame_id) - 0.003);
  }
  const TestReport report = report_of(plates(), frames);
  REQUIRE(report.channels.impact_s);
  CHECK(*report.channels.impact_s == doctest::Approx(0.003));
}

TEST_CASE("frames without a value are bridged; with too few of them there is no rating but a reason") {
  std::vector<wire::WireResult> frames = frames_of(model(), 2);
  for (wire::WireResult& frame : frames)
    if (frame.frame_id % 3 == 1) frame.channels[0].value = std::nanf("");
  const TestReport bridged = report_of(plates(), frames);
  REQUIRE(bridged.channels.channels[0].rating);
  CHECK(bridged.channels.channels[0].rating->overall > 0.99);
  for (wire::WireResult& frame : frames) {
    if (frame.frame_id < 36) frame.channels[0].value = std::nanf("");  // 9 remain, 3 of them without
    frame.channels[1].value = std::nanf("");
  }
  const TestReport few = report_of(plates(), frames);
  CHECK_FALSE(few.channels.channels[0].rating);
  CHECK(few.channels.channels[0].why_not == "6 frames have a value while the simulation lasts; 10 are necessary");
  CHECK(few.channels.channels[1].why_not == "no frame has a value");
  const std::string section = channels_section(few);
  CHECK(contains(section, "Not rated: 6 frames have a value while the simulation lasts; 10 are necessary."));
  CHECK_FALSE(contains(section, "nan"));
}

TEST_CASE("no rating without impact, without the quantity in the model, or with times that go back") {
  std::vector<wire::WireResult> at_rest;
  for (std::uint64_t i = 0; i < 30; ++i)
    at_rest.push_back(frame_like(model(), i, 0.001 * static_cast<double>(i), {0, 0}));
  CHECK(report_of(plates(), at_rest).channels.channels[0].why_not == "the time of the impact is not known");
  std::vector<wire::WireResult> renamed = frames_of(model(), 1), back = renamed;
  for (wire::WireResult& frame : renamed) frame.channels[0].name = "other";
  const TestReport other = report_of(plates(), renamed);
  CHECK(other.channels.channels[0].why_not == "the model does not have this quantity");
  CHECK(other.channels.channels[1].rating);
  back[20].stamp_ns = back[5].stamp_ns;
  CHECK(report_of(plates(), back).channels.channels[0].why_not == "the capture times do not increase");
}

TEST_CASE("page and summary give rating, grade, scores and the simulation's curve") {
  const TestReport report = report_of(plates(), frames_of(model(), 2));
  const std::string section = channels_section(report);
  CHECK_MESSAGE(contains(section, "Rating by ISO/TS 18571, from 0 to 1: how far simulation plate_2 alone"), section);
  CHECK(contains(section, "<td>end x</td><td class=\"number\">1.00</td><td>excellent</td>"));
  CHECK(contains(section, "plate_2 alone"));
  const Json json = Json::parse(summary_json(std::span(&report, 1)));
  CHECK(json["channels_rated_against"]["simulation"] == "plate_2");
  CHECK(json["channels_rated_against"]["impact_seconds"].get<double>() == doctest::Approx(0.002));
  const Json& rating = json["channels"][1]["rating"];
  CHECK(rating["grade"] == "excellent");
  double weighted = 0.4 * rating["corridor"].get<double>();
  for (const char* score : {"phase", "magnitude", "slope"}) weighted += 0.2 * rating[score].get<double>();
  CHECK(rating["overall"].get<double>() == doctest::Approx(weighted));
  std::vector<wire::WireResult> none = frames_of(model(), 2);
  for (wire::WireResult& frame : none) frame.channels[0].value = std::nanf("");
  const TestReport without = report_of(plates(), none);
  const Json unrated = Json::parse(summary_json(std::span(&without, 1)));
  CHECK(unrated["channels"][0]["rating"].is_null());
  CHECK(unrated["channels"][0]["not_rated_because"] == "no frame has a value");
}
