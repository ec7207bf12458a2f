// What a file contains by its trigger, and its name until it is complete.
#include "adapters/mcap/salvage.hpp"
#include "tests/mcap/recorder/recorder_bench.hpp"
#include "tests/support/test_data.hpp"
#include "tools/shared/recording/recording_file.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <fstream>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::tool;
using namespace lbea::test;
using lbea::wire::RecordingPhase;
using namespace std::chrono_literals;

TEST_CASE("a window contains exactly the messages around the trigger") {
  const auto disk = std::make_shared<SharedSink::State>();
  RecorderConfig config = small_config();
  config.window = RecordWindow{50ms, 30ms};
  Recorder recorder(std::make_unique<SharedSink>(disk), config, a_start());
  std::vector<Said> frames;
  std::int64_t trigger = 0;
  const auto put = [&](std::uint32_t i) {
    frames.push_back(numbered(1, i, 200));
    REQUIRE(recorder.put(Recorder::Queue::frames, to_message(frames.back())));
    std::this_thread::sleep_for(1ms);
  };
  std::uint32_t i = 0;
  while (i < 150) put(i++);
  CHECK(recorder.status().phase == RecordingPhase::armed);
  CHECK(recorder.status().frames.outside > 0);
  CHECK(recorder.status().bytes < 2000);
  trigger = now_ns();
  recorder.trigger(trigger);
  recorder.trigger(trigger + 1'000'000'000);  // only the first one is used
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  while (recorder.status().phase != RecordingPhase::finished && std::chrono::steady_clock::now() < deadline) put(i++);
  CHECK(disk->memory.committed);  // without finish(): the file is closed at the end of the window
  for (int more = 0; more < 10; ++more) put(i++);
  const RecorderStatus status = recorder.finish();
  CHECK(status.is_sound());
  std::vector<Said> expected;
  for (const Said& frame : frames) {
    const auto time = static_cast<std::int64_t>(frame.log_time);
    if (time >= trigger - 50'000'000 && time <= trigger + 30'000'000) expected.push_back(frame);
  }
  const Heard heard = hear(disk->memory.bytes);
  check_sound(heard.audit);
  CHECK(on_channel(heard.messages, 1) == expected);
  CHECK(expected.size() > 5);
  CHECK(status.frames.recorded == expected.size());
  CHECK(status.frames.outside == frames.size() - expected.size());
}

TEST_CASE("without a trigger a window records nothing; messages without room in the ring are counted at the trigger") {
  const auto disk = std::make_shared<SharedSink::State>();
  RecorderConfig config = small_config();
  config.window = RecordWindow{10s, 10s};
  {
    Recorder recorder(std::make_unique<SharedSink>(disk), config, a_start());
    for (std::uint32_t i = 0; i < 10; ++i)
      CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, i, 100))));
    const RecorderStatus status = recorder.finish();
    CHECK(status.frames.recorded == 0);
    CHECK(status.frames.outside == 10);
    CHECK(status.has_ended_untriggered());
    CHECK_FALSE(status.is_sound());  // regression: this was a success
  }
  CHECK(on_channel(hear(disk->memory.bytes).messages, 1).empty());
  CHECK(number_in(hear(disk->memory.bytes).audit, "frames_outside") == 10);

  const auto second = std::make_shared<SharedSink::State>();
  Recorder recorder(std::make_unique<SharedSink>(second), config, a_start());
  std::uint64_t accepted = 0;
  for (std::uint32_t i = 0; i < 300; ++i) {
    while (!recorder.put(Recorder::Queue::frames, to_message(numbered(1, i, 20'000)))) std::this_thread::sleep_for(1ms);
    ++accepted;
  }
  const std::uint64_t refused = recorder.status().frames.no_room;  // while this thread was faster
  recorder.trigger(now_ns());
  const RecorderStatus status = recorder.finish();
  CHECK(status.frames.recorded > 0);
  CHECK(status.frames.no_room - refused > 200);  // 1 MB has room for 50 of 300
  CHECK(status.frames.recorded + status.frames.no_room - refused == accepted);
  CHECK_FALSE(status.is_sound());
}

TEST_CASE("a file is named .partial until it is complete; nothing is overwritten") {
  const TemporaryFolder folder;
  const auto file = folder / "run.mcap";
  {
    Recorder recorder(std::make_unique<mcap::PartialFile>(file), small_config(), a_start());
    CHECK(std::filesystem::exists(mcap::partial_name(file)));
    CHECK_FALSE(std::filesystem::exists(file));
    CHECK_THROWS_AS(mcap::PartialFile{file}, Error);  // a second recorder
    CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, 0, 10))));
    CHECK(recorder.finish().phase == RecordingPhase::finished);
  }
  CHECK_FALSE(std::filesystem::exists(mcap::partial_name(file)));
  check_sound(mcap::check_file(mcap::FileSource(file)));
  CHECK_THROWS_AS(mcap::PartialFile{file}, Error);
  CHECK_THROWS_AS(mcap::PartialFile{folder / "no/such/folder/run.mcap"}, Error);
  // Another file gets the name in the meantime: both files are kept.
  const auto other = folder / "other.mcap";
  Recorder recorder(std::make_unique<mcap::PartialFile>(other), small_config(), a_start());
  std::ofstream(other) << "mine";
  const RecorderStatus status = recorder.finish();
  CHECK(status.phase == RecordingPhase::failed);
  CHECK(status.last_error == EEXIST);
  CHECK(std::filesystem::file_size(other) == 4);
  check_sound(mcap::check_file(mcap::FileSource(mcap::partial_name(other))));
}

// Regression: the recording was lost, or the file of another one got its final name.
TEST_CASE("a recording whose .partial name somebody removed, or gave to another one, is complete") {
  const TemporaryFolder folder;
  const auto file = folder / "run.mcap", partial = mcap::partial_name(folder / "run.mcap");
  for (const bool is_replaced : {false, true}) {
    CAPTURE(is_replaced);
    Recorder recorder(std::make_unique<mcap::PartialFile>(file), small_config(), a_start());
    CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, 0, 10))));
    std::filesystem::remove(partial);
    if (is_replaced) std::ofstream(partial) << "another";
    CHECK(recorder.finish().phase == RecordingPhase::finished);
    check_sound(mcap::check_file(mcap::FileSource(file)));
    CHECK(std::filesystem::exists(partial) == is_replaced);
    if (is_replaced) CHECK(std::filesystem::file_size(partial) == 7);
    std::filesystem::remove(file);
  }
}

TEST_CASE("a program that records no frame leaves no file that would prevent its next start") {
  const TemporaryFolder folder;
  const auto file = folder / "run.mcap";
  for (int start = 0; start < 2; ++start)
    Recorder recorder(std::make_unique<mcap::PartialFile>(file), small_config(), a_start());
  RecorderConfig too_much = small_config();
  too_much.frame_ring_bytes = std::size_t{1} << 60;
  CHECK_THROWS_AS(Recorder(std::make_unique<mcap::PartialFile>(file), too_much, a_start()), Error);
  CHECK(std::filesystem::is_empty(folder.path()));
  {
    Recorder recorder(std::make_unique<mcap::PartialFile>(file), small_config(), a_start());
    CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, 0, 10))));
  }
  check_sound(mcap::check_file(mcap::FileSource(file)));  // a file with a frame is kept
}
