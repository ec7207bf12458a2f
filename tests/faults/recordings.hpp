// Short recordings made by the programs: whole, cut, or during a fault.
#pragma once

#include "adapters/mcap/salvage.hpp"
#include "adapters/mcap/sink.hpp"
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/faults/faults.hpp"
#include "tests/wire/wire_support.hpp"

#include <random>

namespace lbea::test {

using namespace lbea::mcap;
using namespace lbea::wire;

inline constexpr std::uint64_t stream_frames = 6;

/// Runs a program that records frames from ipc://FOLDER/frames, sends it some, and interrupts it.
inline Outcome record_stream(std::vector<std::string> words, const std::vector<std::string>& program,
                             const TemporaryFolder& folder) {
  const TemporaryFolder said;
  const std::string endpoint = "ipc://" + (folder / "frames").string();
  words.insert(words.end(), program.begin(), program.end());
  words.insert(words.end(), {"--frames", endpoint, "--json", "--record-memory", "1"});
  Process process(words, said / "out", said / "err");
  eventually([&] { return !process.is_running() || contains(text_of(said / "err"), "ready: "); });
  if (process.is_running()) {
    WireContext context;
    FrameSink sink(context, endpoint);
    eventually([&] { return !process.is_running() || sink.wait_ready(std::chrono::milliseconds(5)); });
    Encoder encoder;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> place(0, 300);
    std::vector<Point> points(300);
    for (std::uint64_t id = 0; id < stream_frames && process.is_running(); ++id) {
      for (Point& point : points) point = {place(random), place(random) / 5, place(random) / 5};
      sink.send(encoder.frame({id, static_cast<std::int64_t>(id), points}, 1), std::chrono::milliseconds(1000));
    }
    sink.tell(encoder.end_of_stream(1, stream_frames), std::chrono::milliseconds(1000));
    static_cast<void>(sink.flush(std::chrono::milliseconds(1000)));
    process.signal(SIGINT);
  }
  return outcome_of(process, said, longest_run);
}

inline std::uint64_t frames_in(const mcap::ByteSource& source) {
  std::uint64_t frames = 0;
  CHECK(mcap::check_file(source, [&](const mcap::Message&, const mcap::Channel* channel) {
          frames += channel != nullptr && channel->topic == "/frames" ? 1u : 0u;
        }).errors.empty());
  return frames;
}

/// A recording of stream_frames frames.
inline std::filesystem::path put_recording(const std::filesystem::path& file) {
  const TemporaryFolder folder;
  const Outcome outcome = record_stream({}, {LBEA_RECORD, file.string()}, folder);
  REQUIRE_MESSAGE(outcome.exit_code == 0, outcome.err);
  REQUIRE(frames_in(mcap::FileSource(file)) == stream_frames);
  return file;
}

/// The same without its last third.
inline std::filesystem::path put_damaged_recording(const std::filesystem::path& file) {
  put_recording(file);
  std::filesystem::resize_file(file, std::filesystem::file_size(file) * 2 / 3);
  return file;
}

}  // namespace lbea::test
