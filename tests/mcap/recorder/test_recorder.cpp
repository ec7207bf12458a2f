// The recorder under load: every message in order, soon.
#include "adapters/mcap/salvage.hpp"
#include "tests/mcap/recorder/recorder_bench.hpp"
#include "tests/support/refusals.hpp"
#include "tools/shared/recording/recording_file.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::tool;
using namespace lbea::test;
using lbea::wire::RecordingPhase;
using namespace std::chrono_literals;

TEST_CASE("two threads, messages of all sizes, wrapping rings: all messages are recorded in order") {
  for (const mcap::Compression compression :
       {mcap::Compression::none, mcap::Compression::lz4, mcap::Compression::zstd}) {
    const auto disk = std::make_shared<SharedSink::State>();
    RecorderConfig config = small_config();
    config.compression = compression;
    config.definitions_interval = 3ms;
    std::vector<Said> frames, notes;
    {
      Recorder recorder(std::make_unique<SharedSink>(disk), config, a_start());
      const auto produce = [&](Recorder::Queue lane, std::uint16_t channel, std::vector<Said>& kept,
                               std::uint32_t count) {
        for (std::uint32_t i = 0; i < count; ++i) {
          const Said message = numbered(channel, i, i * 7919 % 30'000);
          while (!recorder.put(lane, to_message(message))) std::this_thread::sleep_for(1ms);
          kept.push_back(message);
        }
      };
      std::thread other([&] { produce(Recorder::Queue::notes, 2, notes, 1500); });
      produce(Recorder::Queue::frames, 1, frames, 1500);
      other.join();
      const RecorderStatus status = recorder.finish();
      CHECK(status.frames.recorded == 1500);
      CHECK(status.notes.recorded == 1500);
      CHECK(status.phase == RecordingPhase::finished);
      CHECK(status.bytes > 1000);
      CHECK(disk->memory.committed);
    }
    const Heard heard = hear(disk->memory.bytes);
    check_sound(heard.audit);
    CHECK(on_channel(heard.messages, 1) == frames);
    CHECK(on_channel(heard.messages, 2) == notes);
  }
}

TEST_CASE(
    "a recording that claims frames of 200 million points is refused, because a replay allocated 12 GB for them") {
  RunSettings settings;
  settings.matcher.max_points = 200'000'000;
  CHECK_THROWS_WITH_AS(static_cast<void>(settings_from(to_metadata(settings), "hostile.mcap")),
                       doctest::Contains("hostile.mcap: max_points is 200000000, outside 1 to 16777216"), Error);
}

// Regression: a replay allocated memory for 2^32 matches, or rendered all samples before it refused the pose.
TEST_CASE("recorded settings that no matcher has are refused") {
  const auto refusal = [](auto&& change) -> std::string {
    RunSettings settings;
    change(settings.matcher);
    try {
      static_cast<void>(settings_from(to_metadata(settings), "hostile.mcap"));
    } catch (const Error& error) { return error.what(); }
    return "";
  };
  CHECK(refusal([](MatcherConfig&) {}).empty());
  CHECK(refusal([](MatcherConfig& m) { m.T_reference_sensor = {0, -1, 0, 5, 1, 0, 0, 6, 0, 0, 1, 7}; }).empty());
  CHECK(contains(refusal([](MatcherConfig& m) { m.max_matches = 4'000'000'000; }),
                 "hostile.mcap: max_matches is 4000000000, outside 1 to 1000"));
  CHECK(contains(refusal([](MatcherConfig& m) { m.T_reference_sensor[5] = 2; }), "not a rigid transform"));
  CHECK(contains(refusal([](MatcherConfig& m) { m.T_reference_sensor[0] = -1; }), "not a rigid transform"));
  CHECK(contains(refusal([](MatcherConfig& m) { m.T_reference_sensor[3] = std::numeric_limits<float>::quiet_NaN(); }),
                 "not a rigid transform"));
  CHECK(contains(refusal([](MatcherConfig& m) { m.trusted_distance = -1; }), "trusted_distance"));
  CHECK(contains(refusal([](MatcherConfig& m) { m.min_coverage = 2; }), "min_coverage"));
}

TEST_CASE("no message and one message both give a sound file") {
  for (const int count : {0, 1}) {
    const auto disk = std::make_shared<SharedSink::State>();
    Recorder recorder(std::make_unique<SharedSink>(disk), small_config(), a_start());
    if (count == 1) CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, 0, 10))));
    CHECK(recorder.finish().is_sound());
    const Heard heard = hear(disk->memory.bytes);
    check_sound(heard.audit);
    CHECK(on_channel(heard.messages, 1).size() == static_cast<std::size_t>(count));
    CHECK(heard.audit.definitions.channels.contains(1));
    CHECK(number_in(heard.audit, "frames_recorded") == static_cast<std::uint64_t>(count));
  }
}

TEST_CASE("a message leaves the process within about 10 ms without further calls") {
  const auto disk = std::make_shared<SharedSink::State>();
  Recorder recorder(std::make_unique<SharedSink>(disk), small_config(), a_start());
  std::vector<std::int64_t> ages;
  for (std::uint32_t i = 0; i < 20; ++i) {
    const auto begin = std::chrono::steady_clock::now();
    REQUIRE(recorder.put(Recorder::Queue::frames, to_message(numbered(1, i, 100))));
    while (recorder.status().frames.recorded <= i) std::this_thread::sleep_for(100us);
    ages.push_back((std::chrono::steady_clock::now() - begin) / 1us);
    // After a crash now, this message could be recovered.
    if (i % 5 != 0) continue;
    const mcap::Buffer crashed = disk->snapshot();
    MemorySink fixed;
    mcap::recover(mcap::MemorySource(crashed), fixed);
    CHECK(on_channel(hear(fixed.bytes).messages, 1).size() == i + 1);
  }
  std::sort(ages.begin(), ages.end());
  CHECK(ages[ages.size() / 2] < 10'000 * 5);  // the median, with tolerance for busy machines
}

TEST_CASE("a start that cannot be written is an error") {
  for (const std::size_t n : {1u, 2u}) {
    const auto disk = std::make_shared<SharedSink::State>();
    disk->memory.fail_at = n;
    CHECK_THROWS_AS(Recorder(std::make_unique<SharedSink>(disk), small_config(), a_start()), Error);
  }
  RecorderConfig huge = small_config();
  huge.frame_ring_bytes = ~std::size_t{0};
  CHECK_THROWS_AS(Recorder(std::make_unique<SharedSink>(std::make_shared<SharedSink::State>()), huge, a_start()),
                  Error);
}
