// The log of a test: rows, tests one after the other, curves.
#include "tests/monitor/shown_results.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"
#include "tools/monitor/feeds/recording_feed.hpp"
#include "tools/monitor/feeds/test_log.hpp"
#include "tools/shared/recording/run_recorder.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

namespace {

WireResult with_channels(std::uint64_t id, std::size_t channels = 2) {
  WireResult result = result_of(id);
  for (std::size_t c = 0; c < channels; ++c)
    result.channels.push_back(
        {{static_cast<float>(100 * c + id), 0.25f}, "channel, " + std::to_string(c), c == 0 ? "mm" : "mm/s"});
  return result;
}

}  // namespace

TEST_CASE("a log is bounded, covers the whole test, and has a new epoch when rows change") {
  TestLog log(16);
  LogCursor cursor;
  std::size_t read_rows = 0;
  for (std::uint64_t id = 0; id < 1000; ++id) {
    log.add(result_of(id));
    CHECK(log.rows().size() <= 16);
    if (id == 9) {
      const auto first = read(next_rows(log, cursor, 4));
      CHECK(first.head["first"] == 0);
      CHECK(first.section<float>("rows").size() == 4 * TestLog::row_values);
      CHECK(read(next_rows(log, cursor, 100)).head["first"] == 4);
      CHECK(next_rows(log, cursor, 100).empty());
    }
  }
  CHECK(log.results() == 1000);
  CHECK(log.rows().front()[TestLog::frame] == 0);
  CHECK(log.rows().back()[TestLog::frame] >= 1000 - 2 * static_cast<float>(log.every()));
  for (std::size_t i = 1; i < log.rows().size(); ++i)
    CHECK(log.rows()[i][TestLog::frame] - log.rows()[i - 1][TestLog::frame] == static_cast<float>(log.every()));
  const auto anew = read(next_rows(log, cursor, 100));
  CHECK(anew.head["first"] == 0);
  read_rows = anew.section<float>("rows").size() / TestLog::row_values;
  CHECK(read_rows == log.rows().size());
}

TEST_CASE("a new sender begins a new test, a frame without a sender does not; the end is recorded") {
  TestLog log;
  log.add(result_of(5));
  log.add(result_of(6));
  WireResult damaged;
  damaged.status = WireStatus::damaged;
  log.add(damaged);
  CHECK(log.session() == 1);
  CHECK(log.rows().size() == 3);
  WireResult end = result_of(7);
  end.status = WireStatus::end_of_stream;
  log.add(end);
  CHECK(log.is_complete());
  CHECK(log.rows().size() == 3);
  log.add(result_of(0, 2));
  CHECK(!log.is_complete());
  CHECK(log.rows().size() == 1);
  CHECK(log.rows().front()[TestLog::time_s] == 0);
}

// Regression: another sender's end erased the running test, and the next test of a session continued the complete one.
TEST_CASE("the end of another sender's stream changes nothing; a frame after the own end begins a test") {
  TestLog log;
  const auto end = [](std::uint64_t session) {
    WireResult result = result_of(9, session);
    result.status = WireStatus::end_of_stream;
    return result;
  };
  log.add(end(2));
  CHECK(log.rows().empty());
  log.add(result_of(5));
  log.add(result_of(6));
  log.add(end(2));
  CHECK(log.session() == 1);
  CHECK(log.rows().size() == 2);
  CHECK_FALSE(log.is_complete());
  log.add(end(1));
  CHECK(log.is_complete());
  log.add(result_of(7));
  CHECK(log.rows().size() == 1);
  CHECK_FALSE(log.is_complete());
}

// Regression: the curves of a session's last test replaced those before.
TEST_CASE("a recording shows the curves of each test of a session") {
  const TemporaryFolder folder;
  bake_bent_plates(folder / "plates.lbea");
  {
    RunRecorder recorder(folder / "run.mcap", {}, {});
    Encoder encoder;
    const auto record = [&](WireResult result) {
      result.publish_ns = static_cast<std::int64_t>(result.frame_id + 1);
      recorder.result(encoder.result(result), result);
    };
    for (const std::uint64_t test : {0u, 1u}) {
      for (std::uint64_t id = 0; id < 3 + test; ++id) record(result_of(10 * test + id));
      WireResult end = result_of(10 * test + 9);
      end.status = WireStatus::end_of_stream;
      record(end);
    }
    CHECK(recorder.finish().is_sound());
  }
  const auto feed = make_recording_feed(folder / "run.mcap", open_models({(folder / "plates.lbea").string()}));
  const auto frames_of = [&](const std::string& session) {
    const auto response = feed->respond("/api/recording/rows?session=" + session + "&first=0");
    REQUIRE(response);
    return read(response->body).section<float>("rows").size() / TestLog::row_values;
  };
  CHECK(frames_of("1") == 3);
  CHECK(frames_of("1.2") == 4);
  CHECK(frames_of("1.3") == 0);
  CHECK(frames_of("1.0") == 0);
  const auto last = feed->respond("/api/recording/frame?number=5");
  REQUIRE(last);
  CHECK(read(last->body).head["test"]["session"] == "1.2");
}

// Regression: the difference of such stamps is not in the range of their type.
TEST_CASE("times that are far apart are subtracted and added without overflow") {
  constexpr auto most = std::numeric_limits<std::int64_t>::max(), least = std::numeric_limits<std::int64_t>::min();
  TestLog log;
  WireResult first = result_of(0);
  first.stamp_ns = least;
  log.add(first);
  CHECK(log.seconds(most) == doctest::Approx(1.8446744e10));
  CHECK(difference_ns(least, most) == doctest::Approx(-1.8446744e19));
  CHECK(difference_ns(1'700'000'000'000'000'001, 1'700'000'000'000'000'000) == 1);
  CHECK(saturated_sum(most, 1) == most);
  CHECK(saturated_sum(least, -1) == least);
  CHECK(saturated_sum(most, least) == -1);
}

TEST_CASE("curves as CSV: one line per row, quoted names, empty unknown values") {
  TestLog log;
  log.add(result_of(0));
  WireResult refused = result_of(1);
  refused.status = WireStatus::bad_cloud;
  refused.verdict = WireVerdict::refused;
  log.add(refused);
  const std::vector<std::string> names{"a", "b", "run \"b\""};
  const std::string csv = to_csv(log, names);
  CHECK(std::ranges::count(csv, '\n') == 3);
  CHECK(contains(csv, "\n0,0,matched,ok,\"run \"\"b\"\"\",7,1.5,,,,,,,,,,,,0.5,,1,2,0,2,"));
  CHECK(contains(csv, "\n0.001,1,refused,bad_cloud,,,,"));
}

TEST_CASE("channels: curves have gaps at doubtful frames and where there are no values") {
  TestLog log;
  LogCursor cursor;
  log.add(result_of(0));  // as by a matcher that sent its first result before
  const auto before = read(next_rows(log, cursor, 100));
  CHECK(before.head["channels"].empty());
  CHECK(before.section<float>("channels").empty());
  for (std::uint64_t id = 1; id < 5; ++id) {
    WireResult result = with_channels(id);
    if (id == 2) result.verdict = WireVerdict::no_simulation_fits;
    if (id == 3) result.channels.pop_back();
    log.add(result);
  }
  // Rows that the browser has change: it gets all again.
  const auto after = read(next_rows(log, cursor, 3));
  CHECK(after.head["first"] == 0);
  CHECK(after.head["channels"] == nlohmann::json::parse(R"([{"name": "channel, 0", "unit": "mm"},
                                                            {"name": "channel, 1", "unit": "mm/s"}])"));
  auto values = after.section<float>("channels");
  const auto rest = read(next_rows(log, cursor, 100));
  CHECK_FALSE(rest.head.contains("channels"));
  for (const float value : rest.section<float>("channels")) values.push_back(value);
  REQUIRE(values.size() == 5 * 2 * 2);
  const auto is_known = [&](std::size_t row, std::size_t c) { return !std::isnan(values[4 * row + 2 * c]); };
  for (std::size_t row = 0; row < 5; ++row) {
    CHECK(is_known(row, 0) == (row != 0 && row != 2));
    CHECK(is_known(row, 1) == (row == 1 || row == 4));
  }
  CHECK(std::vector<float>(values.end() - 4, values.end()) == std::vector<float>{4, 0.25f, 104, 0.25f});

  const std::string csv = to_csv(log, {});
  const std::string first = csv.substr(0, csv.find('\n'));
  CHECK(
      first.ends_with(",\"channel, 0 [mm]\",\"channel, 0 bound_90 [mm]\",\"channel, 1 [mm/s]\","
                      "\"channel, 1 bound_90 [mm/s]\""));
  CHECK(csv.ends_with(",4,0.25,104,0.25\n"));
  // The next test may have others.
  WireResult next = with_channels(0, 1);
  next.session = 2;
  log.add(next);
  CHECK(log.channels().size() == 1);
  CHECK(log.channel_values().size() == 1);
}

TEST_CASE("channels: the log of many channels holds fewer rows, evenly spaced") {
  constexpr std::size_t channels = 1000;
  TestLog log;
  for (std::uint64_t id = 0; id < 700; ++id) log.add(result_of(id));  // without channels
  REQUIRE(log.rows().size() == 700);
  for (std::uint64_t id = 700; id < 3000; ++id) log.add(with_channels(id, channels));
  CHECK(log.channel_values().size() <= TestLog::most_channel_values);
  CHECK(log.channel_values().size() == log.rows().size() * channels);
  CHECK(log.rows().size() > TestLog::most_channel_values / channels / 2);
  for (std::size_t row = 0; row < log.rows().size(); ++row) {
    const std::uint64_t id = log.ids()[row];
    CHECK(id == row * log.every());
    const ChannelValue last = log.channel_values()[row * channels + channels - 1];
    if (id >= 700) CHECK(last.value == static_cast<float>(100 * (channels - 1) + id));
    if (id < 700) CHECK(std::isnan(last.value));
  }
}
