// Quantities of interest as signals and tables.
#include "tests/report/studied_plates.hpp"
#include "tests/support/refusals.hpp"
#include "tools/report/content/channels/channel_export.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <sstream>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

constexpr double no_value = std::numeric_limits<double>::quiet_NaN();

/// NaN equals NaN.
bool are_same(const std::vector<double>& a, const std::vector<double>& b) {
  return std::ranges::equal(
      a, b, [](double x, double y) { return (std::isnan(x) && std::isnan(y)) || std::abs(x - y) < 1e-9; });
}

/// A record's fields; quoted ones may contain commas, quotes and line ends.
std::vector<std::string> fields_of(std::istream& csv) {
  std::vector<std::string> fields(1);
  bool is_quoted = false;
  for (int c = csv.get(); c != EOF && (is_quoted || c != '\n'); c = csv.get()) {
    if (c == '"' && is_quoted && csv.peek() == '"')
      fields.back() += static_cast<char>(csv.get());
    else if (c == '"')
      is_quoted = !is_quoted;
    else if (c == ',' && !is_quoted)
      fields.emplace_back();
    else
      fields.back() += static_cast<char>(c);
  }
  return fields;
}

}  // namespace

TEST_CASE("equidistant frames keep their values; missing ones and those without a value are unknown") {
  const EvenSamples even =
      evenly_sampled(std::vector<double>{-0.001, 0, 0.001, 0.004, 0.005}, std::vector<double>{1, 2, no_value, 5, 6});
  CHECK(even.first_s == -0.001);
  CHECK(even.interval_s == 0.001);
  CHECK(are_same(even.values, {1, 2, no_value, no_value, no_value, 5, 6}));
  const EvenSamples jitter = evenly_sampled(std::vector<double>{0, 0.000333333, 0.000666667, 0.001},
                                            std::vector<double>{1, 2, 4, 8});  // stamps in whole ns
  CHECK(are_same(jitter.values, {1, 2, 4, 8}));
}

TEST_CASE("frames at other times are interpolated, not across gaps and unknown values") {
  const EvenSamples even = evenly_sampled(std::vector<double>{0, 0.0012, 0.0019, 0.003, 0.006, 0.007},
                                          std::vector<double>{0, 1.2, 1.9, 3, 6, 7});
  CHECK(even.interval_s == doctest::Approx(0.007 / 6));  // median: 1.1 ms
  REQUIRE(even.values.size() == 7);
  for (std::size_t i = 0; i < 7; ++i) {
    const double time_ms = static_cast<double>(i) * 7 / 6;
    if (i >= 3 && i <= 5)
      CHECK(std::isnan(even.values[i]));  // at 3.5 to 5.8 ms: between 3 and 6
    else
      CHECK(even.values[i] == doctest::Approx(time_ms));
  }
  const EvenSamples with_nan =
      evenly_sampled(std::vector<double>{0, 1.1, 1.9, 3}, std::vector<double>{0, no_value, 2, 3});
  CHECK(are_same({with_nan.values.front(), with_nan.values.back()}, {0, 3}));
  CHECK(std::isnan(with_nan.values[1]));
}

TEST_CASE("one frame is one value, none is none, and a long pause does not make millions") {
  const EvenSamples one = evenly_sampled(std::vector<double>{0.25}, std::vector<double>{no_value});
  CHECK(one.first_s == 0.25);
  CHECK(one.interval_s > 0);
  CHECK(are_same(one.values, {no_value}));
  CHECK(evenly_sampled({}, {}).values.empty());
  const EvenSamples pause = evenly_sampled(std::vector<double>{0, 1e-3, 2e-3, 3600}, std::vector<double>{1, 2, 3, 4});
  CHECK(pause.values.size() <= 41);
  CHECK(pause.values.front() == 1);
  CHECK(pause.values.back() == 4);
}

TEST_CASE("signals of the test and of the simulation are in SI units, since the impact") {
  const TestReport report = report_of(plates(), frames_of(model(), 2));
  const io::MmeTest test = mme_of(report);
  REQUIRE(test.channels.size() == 4);
  const io::MmeChannel &of_test = test.channels[2], &alone = test.channels[3];
  CHECK(of_test.code.text() == "000000000200DSZV");
  CHECK(alone.code.text() == "000000000200DSZ0");
  CHECK(of_test.name == "end z");
  CHECK(alone.name == "end z, simulation plate_2");
  CHECK(of_test.source == "camera");
  CHECK(alone.source == "simulation");
  for (const io::MmeChannel* channel : {&of_test, &alone}) {
    CHECK(channel->unit == "m");
    CHECK(channel->interval_s == 0.0005);
  }
  CHECK(of_test.first_s == -0.002);
  CHECK(alone.first_s == 0);
  REQUIRE(of_test.values.size() == 45);
  REQUIRE(alone.values.size() == 41);
  for (std::uint32_t step = 0; step < 41; ++step) {
    const double meters = 1e-3 * double{model().channel_value(1, model().sample_index({2, step}))};
    CHECK(alone.values[step] == doctest::Approx(meters));
    CHECK(of_test.values[4 + step] == doctest::Approx(meters));
  }
}

// Regression: the export read beyond its table of units, and scaled strains like lengths.
TEST_CASE("a field's channel keeps its unit, and has no code of its own") {
  EnsembleDescription description = bent_plates_description();
  ChannelDescription& strain = description.channels.emplace_back();
  strain.name = "strain";
  strain.kind = ChannelKind::maximum;
  strain.field = "plastic_strain";
  const TemporaryFolder folder;
  bake_model(bent_plates({.runs = 4, .steps = 41}), description, folder / "m.lbea");
  const AlignedBytes bytes(folder / "m.lbea");
  const Model of_strain = Model::view(bytes.span());
  const io::MmeTest test = mme_of(report_of(bytes, frames_of(of_strain, 2)));
  REQUIRE(test.channels.size() == 2);
  CHECK(test.channels[1].code.text() == "0000000001000000");
  CHECK(test.channels[1].unit == "1");
  for (std::uint32_t step = 0; step < 41; ++step)
    CHECK(test.channels[1].values[step] ==
          doctest::Approx(double{of_strain.channel_value(0, of_strain.sample_index({2, step}))}));
}

TEST_CASE("frames without a value leave holes; without an impact, times count from the first frame") {
  std::vector<wire::WireResult> frames = frames_of(model(), 0);
  frames[10].channels[0].value = std::nanf("");
  frames[11].verdict = wire::WireVerdict::no_simulation_fits;
  frames.erase(frames.begin() + 20);
  const io::MmeTest test = mme_of(report_of(plates(), frames));
  for (std::size_t i = 0; i < 45; ++i) {
    CHECK(std::isnan(test.channels[0].values[i]) == (i == 10 || i == 11 || i == 20));
    CHECK(std::isnan(test.channels[2].values[i]) == (i == 11 || i == 20));
  }
  const TestReport single = report_of(plates(), {frame_like(model(), 0, 5, {1, 0})});
  const io::MmeTest one = mme_of(single);
  CHECK(one.channels[0].first_s == 0);
  CHECK(one.channels[0].values.size() == 1);
  CHECK(one.facts.back().second == "time 0: the first frame; the impact is not known");
  // Regression: the simulation's times counted from its own impact.
  CHECK(std::ranges::count(one.channels, "simulation", &io::MmeChannel::source) == 0);
  CHECK(csv_of(single).starts_with("frame,time since first frame [s],"));
}

TEST_CASE("no channels, and times that go back, are refused in a sentence") {
  std::vector<wire::WireResult> none = frames_of(model(), 0), back = none;
  for (wire::WireResult& frame : none) frame.channels.clear();
  const TestReport without = report_of(plates(), none);
  check_error(error_of([&] { static_cast<void>(mme_of(without)); }), Status::bad_input, {"no quantities of interest"});
  check_error(error_of([&] { static_cast<void>(csv_of(without)); }), Status::bad_input, {"[[channel]]"});
  back[20].stamp_ns = back[5].stamp_ns;
  const TestReport wrong = report_of(plates(), back);
  check_error(error_of([&] { static_cast<void>(mme_of(wrong)); }), Status::bad_input, {"times do not increase"});
}

TEST_CASE("the table has a row per matched frame; every number reads back exactly") {
  std::vector<wire::WireResult> frames = frames_of(model(), 2);
  for (wire::WireResult& frame : frames) {
    frame.channels[0].bound_90 = 0.1f + static_cast<float>(frame.frame_id);
    frame.channels[1].name = "Höhe, \"oben\"\nlinks";  // not in the model
  }
  frames[7].verdict = wire::WireVerdict::no_simulation_fits;
  frames[8].status = wire::WireStatus::damaged;
  const TestReport report = report_of(plates(), frames);
  std::istringstream csv(csv_of(report));
  CHECK(fields_of(csv) == std::vector<std::string>{"frame", "time since impact [s]", "end x [mm]",
                                                   "end x bound_90 [mm]", "end x plate_2 [mm]",
                                                   "Höhe, \"oben\"\nlinks [mm]", "Höhe, \"oben\"\nlinks bound_90 [mm]",
                                                   "Höhe, \"oben\"\nlinks plate_2 [mm]"});
  for (const wire::WireResult& frame : frames) {
    if (frame.frame_id == 8) continue;
    const std::vector<std::string> fields = fields_of(csv);
    REQUIRE(fields.size() == 8);
    CHECK(fields[0] == std::to_string(frame.frame_id));
    CHECK(std::stod(fields[1]) == doctest::Approx(0.0005 * static_cast<double>(frame.frame_id) - 0.002));
    const bool is_doubtful = frame.frame_id == 7;
    for (const std::size_t i : std::array<std::size_t, 3>{2, 3, 5}) CHECK(fields[i].empty() == is_doubtful);
    if (!is_doubtful) {
      CHECK(std::stof(fields[2]) == frame.channels[0].value);
      CHECK(std::stof(fields[3]) == frame.channels[0].bound_90);
      CHECK(std::stof(fields[5]) == frame.channels[1].value);
    }
    CHECK(fields[6].empty());
    CHECK(fields[7].empty());
    if (frame.frame_id >= 5 && frame.frame_id < 44)
      CHECK(std::stod(fields[4]) ==
            doctest::Approx(double{
                model().channel_value(0, model().sample_index({2, static_cast<std::uint32_t>(frame.frame_id - 4)}))}));
  }
  CHECK(csv.peek() == EOF);
}
