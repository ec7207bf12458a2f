// Quantities of interest in the report: which frames count, what is said about bounds.
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/report/page/page.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

const float unknown_bound = std::nanf("");

wire::WireResult frame_of(std::uint64_t id, std::vector<wire::WireChannel> channels) {
  wire::WireResult result;
  result.session = 1;
  result.frame_id = id;
  result.stamp_ns = static_cast<std::int64_t>(id) * 1'000'000;
  result.verdict = wire::WireVerdict::matched;
  result.channels = std::move(channels);
  return result;
}

wire::WireResult frame_of(std::uint64_t id, float value, float bound) {
  return frame_of(id, {{{value, bound}, "end <x>", "mm"}});
}

wire::WireResult with(wire::WireResult result, wire::WireVerdict verdict) {
  result.verdict = verdict;
  return result;
}

wire::WireResult with(wire::WireResult result, wire::WireStatus status) {
  result.status = status;
  return result;
}

std::string section_of(const std::vector<wire::WireResult>& results) {
  const AlignedBytes bytes = bent_plates_model();
  TestReport report({}, Model::view(bytes.span()), "plates.lbea");
  report.content.tests.push_back({{1, 0}, TestRecord()});
  for (const wire::WireResult& result : results) report.content.tests.back().record.add(result);
  report.test = 0;
  return channels_section(report);
}

std::size_t count_of(const std::string& text, const std::string& part) {
  std::size_t count = 0;
  for (std::size_t at = text.find(part); at != text.npos; at = text.find(part, at + 1)) ++count;
  return count;
}

}  // namespace

TEST_CASE("a channel has its last value and its peak, with the times and bounds of their frames") {
  TestRecord record;
  for (const auto& [id, value] : {std::pair(0, 1.0f), {1, -9.0f}, {2, 9.0f}, {3, 4.0f}})
    record.add(frame_of(static_cast<std::uint64_t>(id), value, 0.5f + static_cast<float>(id)));
  REQUIRE(record.channels().channels().size() == 1);
  const TestChannel& channel = record.channels().channels()[0];
  REQUIRE(channel.last);
  CHECK(channel.last->value == 4);
  CHECK(channel.last->bound_90 == 3.5f);
  CHECK(channel.last->time_s == doctest::Approx(0.003));
  REQUIRE(channel.peak);
  CHECK(channel.peak->value == -9);  // the first of equal magnitudes
  CHECK(channel.peak->bound_90 == 1.5f);
  CHECK(channel.peak->time_s == doctest::Approx(0.001));
  CHECK(record.channels().left_out() == 0);
}

TEST_CASE("doubtful frames are left out of values, peaks and curves, and counted") {
  using wire::WireStatus, wire::WireVerdict;
  const std::vector<wire::WireResult> results{frame_of(0, 1, 0.5f),
                                              with(frame_of(1, 90, 1), WireVerdict::no_simulation_fits),
                                              frame_of(2, 3, 0.5f),
                                              with(frame_of(3, 91, 1), WireVerdict::low_coverage),
                                              with(frame_of(4, 92, 1), WireStatus::low_coverage),
                                              with(frame_of(5, std::vector<wire::WireChannel>{}), WireStatus::damaged),
                                              with(frame_of(6, 5, 0.5f), WireVerdict::ambiguous),
                                              with(frame_of(7, 93, 1), WireVerdict::no_simulation_fits)};
  TestRecord record;
  for (const wire::WireResult& result : results) record.add(result);
  const TestChannel& channel = record.channels().channels()[0];
  CHECK(channel.peak->value == 5);
  CHECK(channel.last->time_s == doctest::Approx(0.006));
  for (const FrameRow& row : record.rows()) CHECK(row.channels.size() == (row.id % 2 == 0 && row.id != 4 ? 1u : 0u));
  const std::string section = section_of(results);
  CHECK_MESSAGE(contains(section,
                         "5 of 8 frames are left out, because their values are doubtful: 2 low_coverage, 1 refused, 2 "
                         "no_simulation_fits."),
                section);
  CHECK(contains(section, "5.00 \u00b1 0.50 mm"));
  CHECK(contains(section, "end &lt;x&gt;"));
  CHECK_FALSE(contains(section, "<x>"));
  const std::string none = section_of({with(frame_of(0, 90, 1), WireVerdict::no_simulation_fits)});
  CHECK(contains(none, "No frame has values to show."));
  CHECK(contains(none, "1 of 1 frames"));
  CHECK_FALSE(contains(none, "<svg"));
}

TEST_CASE("without bounds there is no band, and the page says so; without channels there is no section") {
  const std::string without = section_of({frame_of(0, 1, unknown_bound), frame_of(1, 2, unknown_bound)});
  CHECK(contains(without, "have no bounds"));
  CHECK(contains(without, "No bound is known."));
  CHECK_FALSE(contains(without, "fill-opacity"));
  CHECK(contains(without, "class=\"curve\""));
  const std::string partly = section_of({frame_of(0, 1, 0.5f), frame_of(1, 2, 0.25f), frame_of(2, 3, unknown_bound)});
  CHECK(contains(partly, "fill-opacity"));
  CHECK(contains(partly, "Where the band is missing, no bound is known."));
  CHECK_FALSE(contains(partly, "have no bounds"));
  CHECK(section_of({frame_of(0, std::vector<wire::WireChannel>{})}).empty());
  for (const std::string& section : {without, partly}) CHECK_FALSE(contains(section, "nan"));
}

TEST_CASE("what frames forecast of a channel's end has its own curve and band, where they do") {
  const auto foretold = [](std::uint64_t id, float end, float bound) {
    return frame_of(id, {{{1, 0.5f}, "end", "mm", {end, bound}}});
  };
  const std::string section = section_of({foretold(0, 90, 20), foretold(1, 95, 10), foretold(2, 97, unknown_bound)});
  CHECK(contains(section, "forecast of the end"));
  CHECK(contains(section, "90 % interval of the end"));
  CHECK_FALSE(contains(section_of({frame_of(0, 1, 0.5f), frame_of(1, 2, 0.5f)}), "forecast of the end"));
  CHECK_FALSE(contains(section, "nan"));
}

TEST_CASE("channels keep their places when a later frame has more of them") {
  TestRecord record;
  record.add(frame_of(0, {{{1, 1}, "a", ""}, {{2, 1}, "b", ""}}));
  record.add(frame_of(1, {{{3, 1}, "c", ""}, {{4, 1}, "b", ""}}));
  REQUIRE(record.channels().channels().size() == 3);
  const FrameRow& row = record.rows()[1];
  REQUIRE(row.channels.size() == 3);
  CHECK(std::isnan(row.channels[0].value));
  CHECK(row.channels[1].value == 4);
  CHECK(row.channels[2].value == 3);
}

TEST_CASE("of very many channels all have their row, and the curves that are not drawn are counted") {
  std::vector<wire::WireChannel> many;
  for (int i = 0; i < 60; ++i) many.push_back({{1.0f, 1.0f}, "channel " + std::to_string(i), "mm"});
  const std::string section = section_of({frame_of(0, many), frame_of(1, many)});
  CHECK(count_of(section, "<tr><td>") == 60);
  CHECK(count_of(section, "<figure>") == 48);
  CHECK(contains(section, "The curves of 12 more quantities are not drawn."));
}
