// lbea-send as a process, with a pipeline in this process.
#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tests/support/instrumented.hpp"
#include "tests/support/test_data.hpp"
#include "tests/wire/wire_support.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

using namespace lbea;
using namespace lbea::wire;
using namespace std::chrono_literals;
using lbea::test::contains;
using lbea::test::Process;
using lbea::test::text_of;

namespace {

/// A folder of clouds c0.ply, c1.ply, ... with i + 1 points at x = i, stamped 1,000,000 + i ms.
class Bench {
 public:
  explicit Bench(int clouds = 3, bool stamped = true) {
    std::filesystem::create_directory(folder / "clouds");
    for (int i = 0; i < clouds; ++i) {
      std::ofstream out(folder / ("clouds/c" + std::to_string(i) + ".ply"));
      out << "ply\nformat ascii 1.0\n";
      if (stamped) out << "comment stamp_ns " << 1'000'000'000 + 1'000'000 * i << "\n";
      out << "element vertex " << i + 1 << "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
      for (int j = 0; j <= i; ++j) out << i << " " << j << " 0.5\n";
    }
  }
  std::unique_ptr<Process> start(std::vector<std::string> arguments) {
    arguments.insert(arguments.begin(), LBEA_SEND);
    return std::make_unique<Process>(arguments, out(), err());
  }
  int run(const std::vector<std::string>& arguments) { return start(arguments)->wait(); }
  [[nodiscard]] std::string clouds() const { return (folder / "clouds").string(); }
  [[nodiscard]] std::string endpoint() const { return "ipc://" + (folder / "frames").string(); }
  [[nodiscard]] std::string out() const { return (folder / "out").string(); }
  [[nodiscard]] std::string err() const { return (folder / "err").string(); }

  test::TemporaryFolder folder;
};

struct Received {
  std::vector<DecodedFrame> frames;
  std::uint64_t end_id = 0;
  std::vector<std::uint64_t> end_ids;
};

/// The next frame; control messages are skipped.
std::optional<Message> next_frame(FrameSource& source) {
  while (const auto message = source.receive(30s))
    if (message_kind(*message) != MessageKind::control) return message;
  return {};
}

/// Everything up to the end of the stream, or to the last one of several.
Received receive_all(FrameSource& source, int ends = 1) {
  Received received;
  while (true) {
    const auto message = next_frame(source);
    REQUIRE(message);
    DecodedFrame frame;
    const WireStatus status = decode_frame(*message, frame);
    received.end_id = frame.header.id;
    if (status == WireStatus::end_of_stream) {
      received.end_ids.push_back(frame.header.id);
      if (--ends == 0) return received;
      continue;
    }
    REQUIRE(status == WireStatus::ok);
    received.frames.push_back(std::move(frame));
  }
}

}  // namespace

TEST_CASE("a folder is sent in the order of names, with rising ids, the files' stamps and an end of stream") {
  Bench bench;
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto sender = bench.start({bench.clouds(), "--to", bench.endpoint(), "--loop", "4", "--json"});
  const Received received = receive_all(source, 4);
  CHECK(sender->wait() == 0);
  REQUIRE(received.frames.size() == 12);
  CHECK(received.end_ids == std::vector<std::uint64_t>{3, 6, 9, 12});  // regression: the rounds were one test
  for (std::size_t i = 0; i < 12; ++i) {
    const DecodedFrame& frame = received.frames[i];
    CHECK(frame.header.id == i);
    CHECK(frame.header.session == received.frames[0].header.session);
    CHECK(frame.header.stamp_ns == 1'000'000'000 + 1'000'000 * static_cast<std::int64_t>(i % 3));
    CHECK(frame.coordinate_system == "sensor");
    REQUIRE(frame.points.size() == i % 3 + 1);
    CHECK(frame.points.back().x == static_cast<float>(i % 3));
    CHECK(frame.points.back().y == static_cast<float>(i % 3));
    CHECK(frame.points.back().z == 0.5f);
  }
  CHECK(contains(text_of(bench.out()), R"("captured":12,"sent":12,"refused":0,"handed_over":12)"));
}

// Regression: without a known total, every frame printed a line of progress.
TEST_CASE("in an endless loop, progress is a line every few seconds" *
          doctest::skip(std::getenv("LBEA_LONG_TESTS") == nullptr)) {
  Bench bench(2);
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto sender =
      bench.start({bench.clouds(), "--to", bench.endpoint(), "--rate", "200", "--loop", "0", "--open-end"});
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 1'300; ++i) REQUIRE(next_frame(source));  // 6.5 s
  sender->signal(SIGINT);
  static_cast<void>(sender->wait());
  const std::string said = text_of(bench.err());
  const auto seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  CHECK(contains(said, "sending: "));
  CHECK(static_cast<double>(std::ranges::count(said, '\n')) <= seconds / 5 + 3);
}

TEST_CASE("with --open-end, rounds are one test too") {
  Bench bench;
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto sender = bench.start({bench.clouds(), "--to", bench.endpoint(), "--loop", "2", "--open-end"});
  CHECK(sender->wait() == 0);
  DecodedFrame frame;
  for (int i = 0; i < 6; ++i) {
    const auto message = next_frame(source);
    REQUIRE(message);
    CHECK(decode_frame(*message, frame) == WireStatus::ok);
  }
}

TEST_CASE("clouds without a stamp get the current time") {
  Bench bench(2, false);
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto now_ns = [] {
    return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
        .count();
  };
  const std::int64_t before = now_ns();
  const auto sender = bench.start({bench.clouds() + "/c1.ply", bench.clouds() + "/c0.ply", "--to", bench.endpoint()});
  const Received received = receive_all(source);
  CHECK(sender->wait() == 0);
  REQUIRE(received.frames.size() == 2);
  CHECK(received.frames[0].points.size() == 2);  // files in the order given
  CHECK(received.frames[0].header.stamp_ns >= before);
  CHECK(received.frames[1].header.stamp_ns >= received.frames[0].header.stamp_ns);
  CHECK(received.frames[1].header.stamp_ns <= now_ns());
  CHECK(contains(text_of(bench.err()), "warning: the clouds have no capture times"));
}

TEST_CASE("clouds of another format, stamped by a table beside them") {
  Bench bench(0);
  for (const char* name : {"a", "b"})
    test::put(bench.folder / ("clouds/" + std::string(name) + ".pcd"),
              "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n");
  test::put(bench.folder / "clouds/stamps.csv", "file,stamp_ms\na.pcd,1000\nb.pcd,1000.5\n");
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto sender = bench.start({bench.clouds(), "--to", bench.endpoint()});
  const Received received = receive_all(source);
  CHECK(sender->wait() == 0);
  REQUIRE(received.frames.size() == 2);
  CHECK(received.frames[0].header.stamp_ns == 1'000'000'000);
  CHECK(received.frames[1].header.stamp_ns == 1'000'500'000);
  CHECK(received.frames[1].points.at(0).z == 3.0f);
}

TEST_CASE("the pace: at a rate, and by the stamps" * doctest::skip(test::is_instrumented)) {
  Bench bench(5);
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto seconds_of = [&](const std::vector<std::string>& pace, std::size_t frames) {
    const int rounds = static_cast<int>(frames / 5);
    std::vector<std::string> arguments{bench.clouds(), "--to", bench.endpoint()};
    arguments.insert(arguments.end(), pace.begin(), pace.end());
    const auto sender = bench.start(arguments);
    REQUIRE(next_frame(source));
    const auto begin = std::chrono::steady_clock::now();
    const Received received = receive_all(source, rounds);
    CHECK(received.end_id == frames);
    // On a loaded machine this program may not read for longer than frames have room.
    CHECK(sender->wait() == (received.frames.size() == frames - 1 ? 0 : 1));
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  // Never early; late on a loaded machine. The first frame may itself be a little late.
  CHECK(seconds_of({"--rate", "20", "--loop", "2"}, 10) > 9 / 20.0 - 0.1);
  CHECK(seconds_of({"--realtime", "--loop", "40"}, 200) > 199 * 0.001 - 0.1);
}

TEST_CASE("a paced sender does not wait for a receiver that does not read; it counts refusals") {
  Bench bench;
  WireContext context;
  const FrameSource source(context, bench.endpoint());
  std::ofstream(bench.folder / "big.xyz") << [] {
    std::string text;
    for (int i = 0; i < 40'000; ++i) text += "1 2 3\n";
    return text;
  }();
  CHECK(bench.run({(bench.folder / "big.xyz").string(), "--to", bench.endpoint(), "--rate", "2000", "--loop", "200",
                   "--json"}) == 1);
  const std::string tally = text_of(bench.out());
  CHECK(contains(tally, "\"captured\":200"));
  CHECK_FALSE(contains(tally, "\"refused\":0,"));
}

TEST_CASE("Ctrl-C ends an endless loop cleanly") {
  Bench bench(3, false);  // without stamps, the rounds are one test
  WireContext context;
  FrameSource source(context, bench.endpoint());
  const auto sender = bench.start({bench.clouds(), "--to", bench.endpoint(), "--rate", "200", "--loop", "0"});
  for (int i = 0; i < 10; ++i) REQUIRE(next_frame(source));
  sender->signal(SIGINT);
  const Received rest = receive_all(source);
  CHECK(sender->wait() == 0);
  CHECK(rest.end_id == 10 + rest.frames.size());
}

TEST_CASE("after a sender is killed in mid-stream the next one is served") {
  Bench bench;
  WireContext context;
  FrameSource source(context, bench.endpoint());
  for (int round = 0; round < 3; ++round) {
    const auto doomed = bench.start({bench.clouds(), "--to", bench.endpoint(), "--loop", "0"});
    for (int i = 0; i < 50; ++i) REQUIRE(next_frame(source));
    doomed->signal(SIGKILL);
    CHECK(doomed->wait() == 128 + SIGKILL);
  }
  while (source.receive(200ms)) {}
  const auto sender = bench.start({bench.clouds(), "--to", bench.endpoint()});
  CHECK(receive_all(source).frames.size() == 3);
  CHECK(sender->wait() == 0);
}

TEST_CASE("--wait-ready waits for a receiver that starts later") {
  Bench bench;
  const auto sender = bench.start({bench.clouds(), "--to", bench.endpoint(), "--wait-ready"});
  std::this_thread::sleep_for(300ms);
  CHECK(sender->is_running());
  WireContext context;
  FrameSource source(context, bench.endpoint());
  CHECK(receive_all(source).frames.size() == 3);
  CHECK(sender->wait() == 0);
}

TEST_CASE("errors are reported in a sentence") {
  Bench bench;
  const auto fails = [&](const std::vector<std::string>& arguments, int code, const std::string& sentence) {
    CAPTURE(sentence);
    CHECK(bench.run(arguments) == code);
    const std::string said = text_of(bench.err());
    CAPTURE(said);
    CHECK(contains(said, sentence));
  };
  fails({}, 2, "paths");
  fails({bench.clouds()}, 2, "--to");
  fails({bench.clouds(), "--to", bench.endpoint(), "--rate", "-1"}, 2, "--rate");
  fails({bench.clouds(), "--to", bench.endpoint(), "--rate", "nan"}, 2, "--rate: \"nan\" is not a finite number");
  fails({bench.clouds(), "--to", bench.endpoint(), "--rate", "5", "--realtime"}, 2, "--realtime");
  fails({bench.clouds(), "--to", bench.endpoint(), "--speed", "5"}, 2, "--speed");
  fails({"/no/such/file.ply", "--to", bench.endpoint()}, 1, "/no/such/file.ply: no such file or folder");
  fails({bench.folder.path().string() + "/clouds/..", "--to", bench.endpoint()}, 1, "no clouds in this folder");
  fails({bench.clouds(), "--to", "nonsense"}, 1, "\"nonsense\"");
  fails({bench.clouds(), "--to", bench.endpoint()}, 1, "nobody listens there");
  CHECK(bench.run({"--help"}) == 0);
  CHECK(contains(text_of(bench.out()), "lbea-send frames/"));
  CHECK(bench.run({"--list-formats"}) == 0);
  CHECK(contains(text_of(bench.out()), "PCD"));
  CHECK(bench.run({"--version"}) == 0);

  // Regression: frames of two clocks made one test.
  std::ofstream(bench.folder / "clouds" / "unstamped.ply") << text_of(Bench(1, false).clouds() + "/c0.ply");
  fails({bench.clouds(), "--to", bench.endpoint()}, 1, "unstamped.ply: has no capture time, but other clouds have one");
  std::filesystem::remove(bench.folder / "clouds" / "unstamped.ply");

  Bench unstamped(1, false);
  CHECK(unstamped.run({unstamped.clouds(), "--to", unstamped.endpoint(), "--realtime"}) == 1);
  CHECK(contains(text_of(unstamped.err()), "has no stamp to pace by"));
}
