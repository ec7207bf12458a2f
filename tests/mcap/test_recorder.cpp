// The recorder under load with disks that fail, stall and fill up: exactly the missing messages are counted.
#include "adapters/mcap/salvage.hpp"
#include "tools/shared/recording/recorder.hpp"
#include "tools/shared/recording/recording_file.hpp"
#include "tools/shared/recording/recording_format.hpp"

#include "tests/mcap/format/mcap_support.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

#include <atomic>
#include <csignal>
#include <fstream>
#include <limits>
#include <mutex>

#include <sys/resource.h>

using namespace lbea;
using namespace lbea::mcap;
using namespace lbea::tool;
using namespace lbea::test;
using lbea::wire::RecordingPhase;
using namespace std::chrono_literals;

namespace {

/// A memory sink that outlives its recorder, may stall, and may be read while it is written.
class SharedSink final : public mcap::Sink {
 public:
  struct State {
    std::mutex mutex;
    MemorySink memory;
    std::atomic<std::chrono::milliseconds> stall{std::chrono::milliseconds(0)};
    std::uint64_t capacity = std::numeric_limits<std::uint64_t>::max();
    mcap::Buffer snapshot() {
      const std::lock_guard lock(mutex);
      return memory.bytes;
    }
  };
  explicit SharedSink(std::shared_ptr<State> state) : state_(std::move(state)) {}
  int append(std::span<const mcap::Bytes> pieces) noexcept override {
    std::this_thread::sleep_for(state_->stall.load());
    const std::lock_guard lock(state_->mutex);
    std::uint64_t bytes = 0;
    for (const mcap::Bytes piece : pieces) bytes += piece.size();
    return bytes > state_->capacity - state_->memory.bytes.size() ? ENOSPC : state_->memory.append(pieces);
  }
  [[nodiscard]] std::uint64_t free_bytes() const noexcept override {
    const std::lock_guard lock(state_->mutex);
    return state_->capacity - state_->memory.bytes.size();
  }
  int sync() noexcept override { return 0; }  // called by another thread, so not numbered
  int commit() noexcept override {
    const std::lock_guard lock(state_->mutex);
    return state_->memory.commit();
  }

 private:
  std::shared_ptr<State> state_;
};

constexpr std::uint16_t status_channel = 9;

RecordingStart a_start() {
  RecordingStart start;
  start.header = {"test", "test"};
  start.schemas = {a_schema(1), a_schema(2)};
  start.channels = {a_channel(1, 1), a_channel(2, 2), a_channel(status_channel, 0)};
  start.metadata = {{"about", {{"a", "b"}}}};
  start.status_channel = status_channel;
  return start;
}

RecorderConfig small_config() {
  RecorderConfig config;
  config.frame_ring_bytes = 1 << 20;
  config.note_ring_bytes = 1 << 20;
  config.chunk_bytes = 1 << 14;
  return config;
}

std::int64_t now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

/// A message with unique data.
Said numbered(std::uint16_t channel, std::uint32_t number, std::size_t bytes, std::int64_t time = 0) {
  std::string data = std::to_string(channel) + ":" + std::to_string(number) + ":";
  data.resize(std::max(bytes, data.size()), static_cast<char>('a' + number % 26));
  return {channel, number, static_cast<std::uint64_t>(time != 0 ? time : now_ns()), number, data};
}

std::vector<Said> on_channel(const std::vector<Said>& messages, std::uint16_t channel) {
  std::vector<Said> found;
  for (const Said& message : messages)
    if (message.channel == channel) found.push_back(message);
  return found;
}

std::uint64_t number_in(const mcap::FileCheck& audit, const std::string& key) {
  for (const mcap::Metadata& metadata : audit.metadata)
    if (metadata.name == closing_metadata_name) return std::stoull(metadata.texts.at(key));
  return ~std::uint64_t{0};
}

void check_sound(const mcap::FileCheck& audit) {
  for (const std::string& error : audit.errors) CHECK_MESSAGE(false, error);
  CHECK(audit.is_intact());
  CHECK(audit.has_summary);
}

}  // namespace

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
