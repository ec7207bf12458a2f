// Disks that fail, stall and fill up: exactly the missing messages are counted.
#include "adapters/mcap/salvage.hpp"
#include "tests/mcap/recorder/recorder_bench.hpp"
#include "tests/support/test_data.hpp"
#include "tools/shared/recording/recording_file.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <csignal>

#include <sys/resource.h>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::tool;
using namespace lbea::test;
using lbea::wire::RecordingPhase;
using namespace std::chrono_literals;

TEST_CASE("a slow disk and a full ring: every loss is counted, everything else is recorded, results survive") {
  const auto disk = std::make_shared<SharedSink::State>();
  disk->stall = 20ms;
  Recorder recorder(std::make_unique<SharedSink>(disk), small_config(), a_start());
  std::vector<Said> kept, notes;
  std::uint64_t lost = 0;
  for (std::uint32_t i = 0; i < 400; ++i) {
    const Said frame = numbered(1, i, 20'000), note = numbered(2, i, 100);
    recorder.put(Recorder::Queue::frames, to_message(frame)) ? kept.push_back(frame) : void(++lost);
    REQUIRE(recorder.put(Recorder::Queue::notes, to_message(note)));
    notes.push_back(note);
    if (i == 200) CHECK(recorder.status().frames.lost() == lost);
  }
  disk->stall = 0ms;
  const RecorderStatus status = recorder.finish();
  CHECK(lost > 0);
  CHECK(status.frames.no_room == lost);
  CHECK(status.frames.recorded == kept.size());
  CHECK(status.notes.lost() == 0);
  CHECK_FALSE(status.is_sound());
  CHECK(status.ring_peak > status.ring_bytes / 2);
  const Heard heard = hear(disk->memory.bytes);
  check_sound(heard.audit);
  CHECK(on_channel(heard.messages, 1) == kept);
  CHECK(on_channel(heard.messages, 2) == notes);
  CHECK(number_in(heard.audit, "frames_lost_no_room") == lost);
  // The loss reports contain it.
  const auto reports = on_channel(heard.messages, status_channel);
  REQUIRE_FALSE(reports.empty());
  CHECK(reports.back().data.find("\"lost_frames\":{\"no_room\":" + std::to_string(lost) + ",") != std::string::npos);
}

TEST_CASE("on a full disk frames are lost, but results and states are recorded and the file is closed") {
  const auto disk = std::make_shared<SharedSink::State>();
  disk->capacity = 1'000'000;
  RecorderConfig config = small_config();
  config.frame_ring_bytes = 8 << 20;
  Recorder recorder(std::make_unique<SharedSink>(disk), config, a_start());
  std::vector<Said> notes;
  for (std::uint32_t i = 0; i < 200; ++i) {  // 4 MB of frames, 20 kB of notes
    CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, i, 20'000))));
    notes.push_back(numbered(2, i, 100));
    CHECK(recorder.put(Recorder::Queue::notes, to_message(notes.back())));
    if (i % 10 == 0) std::this_thread::sleep_for(10ms);
  }
  const RecorderStatus status = recorder.finish();
  CHECK(status.phase == RecordingPhase::finished);
  CHECK(status.frames.recorded > 20);
  CHECK(status.frames.write_failed == 200 - status.frames.recorded);
  CHECK(status.notes.lost() == 0);
  CHECK(status.last_error == ENOSPC);
  const Heard heard = hear(disk->memory.bytes);
  check_sound(heard.audit);
  CHECK(on_channel(heard.messages, 2) == notes);
}

TEST_CASE("a message larger than the ring is lost and counted") {
  const auto disk = std::make_shared<SharedSink::State>();
  Recorder recorder(std::make_unique<SharedSink>(disk), small_config(), a_start());
  CHECK_FALSE(recorder.put(Recorder::Queue::frames, to_message(numbered(1, 0, 2 << 20))));
  CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, 1, 100))));
  const RecorderStatus status = recorder.finish();
  CHECK(status.frames.no_room == 1);
  CHECK(status.frames.recorded == 1);
}

TEST_CASE("whichever write fails, once or permanently: it is counted and the file is sound") {
  for (const bool persists : {false, true}) {
    std::size_t n = 3;  // the first two are the start of the file
    for (bool reached = true; reached && n < 60; ++n) {
      CAPTURE(persists);
      CAPTURE(n);
      const auto disk = std::make_shared<SharedSink::State>();
      disk->memory.fail_at = n;
      disk->memory.persists = persists;
      RecorderConfig config = small_config();
      config.chunk_bytes = 4000;
      Recorder recorder(std::make_unique<SharedSink>(disk), config, a_start());
      for (std::uint32_t i = 0; i < 30; ++i) {
        CHECK(recorder.put(Recorder::Queue::frames, to_message(numbered(1, i, 1000))));
        if (i % 10 == 0) std::this_thread::sleep_for(1ms);
      }
      const RecorderStatus status = recorder.finish();
      reached = disk->memory.calls >= n;
      CHECK(status.frames.recorded + status.frames.write_failed == 30);
      // A failed write without messages loses nothing, because definitions are repeated.
      CHECK(status.is_sound() == (status.frames.recorded == 30 && status.phase == RecordingPhase::finished));
      if (reached) CHECK(status.last_error != 0);
      CHECK((status.phase == RecordingPhase::finished) == disk->memory.committed);
      if (persists && reached) CHECK(status.phase == RecordingPhase::failed);
      if (disk->memory.committed) check_sound(hear(disk->memory.bytes).audit);
      MemorySink fixed;
      mcap::recover(mcap::MemorySource(disk->memory.bytes), fixed);
      check_sound(hear(fixed.bytes).audit);
      CHECK(on_channel(hear(fixed.bytes).messages, 1).size() == status.frames.recorded);
    }
    CHECK(n > 8);
  }
}

TEST_CASE("a loss report that could not be written is written again without a change") {
  const auto disk = std::make_shared<SharedSink::State>();
  disk->memory.fail_at =
      3;  // the first two are the start of the file, the third is a chunk with definitions and the loss report
  Recorder recorder(std::make_unique<SharedSink>(disk), small_config(), a_start());
  const auto deadline = std::chrono::steady_clock::now() + 20s;
  while (recorder.status().last_error == 0 && std::chrono::steady_clock::now() < deadline)
    std::this_thread::sleep_for(1ms);
  const RecorderStatus status = recorder.finish();
  CHECK(status.last_error != 0);
  CHECK(status.phase == RecordingPhase::finished);
  CHECK(status.bytes == disk->memory.bytes.size());
  CHECK_FALSE(on_channel(hear(disk->memory.bytes).messages, status_channel).empty());
}

TEST_CASE("a full disk: the file stays sound and recording continues once there is space") {
  const TemporaryFolder folder;
  const auto file = folder / "run.mcap";
  mcap::PartialFile sink(file);
  const mcap::Buffer some(100'000, std::byte{1});
  const std::array<mcap::Bytes, 2> pieces{some, mcap::Bytes(some).first(77)};
  REQUIRE(sink.append(pieces) == 0);
  rlimit before{};
  REQUIRE(::getrlimit(RLIMIT_FSIZE, &before) == 0);
  std::signal(SIGXFSZ, SIG_IGN);
  const rlimit tight{150'000, before.rlim_max};
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &tight) == 0);
  const int error = sink.append(pieces);
  REQUIRE(::setrlimit(RLIMIT_FSIZE, &before) == 0);
  CHECK(error == EFBIG);
  CHECK(std::filesystem::file_size(mcap::partial_name(file)) == 100'077);
  CHECK(sink.append(pieces) == 0);
  CHECK(sink.commit() == 0);
  CHECK(std::filesystem::file_size(file) == 2 * 100'077);
}
