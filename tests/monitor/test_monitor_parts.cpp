// Who may connect, and the health of the test.
#include "tests/monitor/shown_results.hpp"
#include "tests/support/refusals.hpp"
#include "tools/monitor/feeds/health.hpp"
#include "tools/monitor/web/access.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::wire;
using namespace lbea::test;

TEST_CASE("addresses to serve on") {
  CHECK(http::parse_address("127.0.0.1:8080", "--http").is_loopback);
  CHECK(http::parse_address("localhost:0", "--http").host == "127.0.0.1");
  CHECK(http::parse_address("[::1]:80", "--http").is_loopback);
  CHECK(!http::parse_address("0.0.0.0:8080", "--http").is_loopback);
  CHECK(!http::parse_address("[::]:8080", "--http").is_loopback);
  CHECK(!http::parse_address("192.168.1.4:65535", "--http").is_loopback);
  for (const std::string& text : std::vector<std::string>{"", "8080", "127.0.0.1", "127.0.0.1:", "127.0.0.1:65536",
                                                          "127.0.0.1:-1", "127.0.0.1:80x", "rig:8080", "::1:80",
                                                          "[::1]", "127.evil.example:80", "[127.0.0.1]:80"})
    CHECK_MESSAGE(
        error_of([&] { static_cast<void>(http::parse_address(text, "--http")); }).status == Status::bad_config, text);
}

TEST_CASE("tokens are long and differ") {
  CHECK(random_token().size() == 32);
  CHECK(random_token() != random_token());
  CHECK(http::query_value("/?a=1&token=xy&b=", "token") == "xy");
  CHECK(http::query_value("/?a=1&token=xy&b=", "b").empty());
  CHECK(http::query_value("/token=1", "token").empty());
  CHECK(http::query_value("/?mytoken=1", "token").empty());
}

TEST_CASE("health: rates, latency, lost results, ages") {
  Health health;
  const auto begin = Health::Clock::now();
  for (int i = 0; i <= 100; ++i) {
    WireResult result = result_of(static_cast<std::uint64_t>(i));
    result.counters.received = static_cast<std::uint64_t>(i);
    health.add(result, begin + std::chrono::milliseconds(20 * i));
  }
  WireResult late = result_of(111);
  late.elapsed_ns.total = 40'000'000;
  health.add(late, begin + std::chrono::milliseconds(2020));
  const auto report = health.report(begin + std::chrono::milliseconds(2520));
  CHECK(report["rate"].get<double>() == doctest::Approx(50).epsilon(0.05));
  CHECK(report["results_lost_here"] == 10);
  CHECK(report["heard_ms"] == 500);
  CHECK(report["latency"]["p50_ms"].get<double>() == doctest::Approx(2));
  CHECK(report["latency"]["p99_ms"].get<double>() < 40);
  CHECK(health.report(begin + std::chrono::minutes(1))["rate"] == 0.0);
}

TEST_CASE("health of several rigs: rate, age, coverage and pose of each, also of one that has sent nothing") {
  Health health;
  const auto begin = Health::Clock::now();
  WireState state;
  state.rigs = {{"left", "", 0, {}}, {"right", "", 2'500'000, {}}};
  state.rigs[1].counters.by_status[static_cast<std::size_t>(WireStatus::out_of_step)] = 3;
  health.add(state, begin);
  WireResult result = result_of(0);
  result.rigs.resize(1);
  result.rigs[0].rig = "left";
  result.rigs[0].coverage = 0.75f;
  result.rigs[0].is_used = true;
  result.rigs[0].pose_shift = 1.5f;
  for (int i = 0; i <= 100; ++i) health.add(result, begin + std::chrono::milliseconds(20 * i));
  const auto rigs = health.report(begin + std::chrono::milliseconds(2500))["rigs"];
  REQUIRE(rigs.size() == 2);
  CHECK(rigs[0]["name"] == "left");
  CHECK(rigs[0]["rate"].get<double>() == doctest::Approx(50).epsilon(0.05));
  CHECK(rigs[0]["last_frame_ms"] == 500);
  CHECK(rigs[0]["coverage"] == 0.75);
  CHECK(rigs[0]["pose_shift"] == 1.5);
  CHECK(rigs[1]["last_frame_ms"].is_null());
  CHECK(rigs[1]["clock_offset_ms"] == 2.5);
  CHECK(rigs[1]["counters"]["dropped"] == 3);
}

TEST_CASE("remaining recording time at the current rate") {
  using namespace std::chrono_literals;
  Health health;
  const auto begin = Health::Clock::now();
  const auto after = [&](std::chrono::seconds time, std::optional<WireRecording> recording) {
    WireState state;
    state.recording = recording;
    health.add(state, begin + time);
    return health.report(begin + time)["server"]["recording"];
  };
  CHECK(after(0s, {}).is_null());
  const auto first = after(1s, WireRecording{RecordingPhase::armed, 1'000, 5'000'000'000});
  CHECK(first["phase"] == "armed");
  CHECK(first["free_bytes"] == 5'000'000'000);
  CHECK(first["seconds_left"].is_null());  // no rate yet
  const auto second = after(5s, WireRecording{RecordingPhase::recording, 400'001'000, 4'600'000'000});
  CHECK(second["bytes_per_s"] == 1e8);
  CHECK(second["seconds_left"] == 46);
  // Bytes written more than ten seconds ago do not count.
  CHECK(after(20s, WireRecording{RecordingPhase::recording, 400'001'000, 4'600'000'000})["seconds_left"].is_null());
  CHECK(after(22s, WireRecording{RecordingPhase::recording, 600'001'000, 4'400'000'000})["seconds_left"] == 44);
  CHECK(after(23s, WireRecording{RecordingPhase::recording, 700'001'000, WireRecording::unknown})["free_bytes"]
            .is_null());
  // A new file starts a new rate.
  CHECK(after(24s, WireRecording{RecordingPhase::recording, 5, 4'400'000'000})["bytes_per_s"] == 0);
  CHECK(after(25s, {}).is_null());
}
