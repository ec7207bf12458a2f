// Programs whose log nobody reads any more: a pipe without a reader, a stopped terminal.
#include "tests/mcap/bench.hpp"

#include <array>

#include <fcntl.h>
#include <pty.h>
#include <sys/stat.h>
#include <termios.h>

using namespace lbea::test;

namespace {

/// Reads what the program logs until it is ready.
void wait_until_ready(int log) {
  ::fcntl(log, F_SETFL, O_NONBLOCK);
  std::string text;
  std::array<char, 4096> some{};
  REQUIRE(eventually([&] {
    if (const ssize_t got = ::read(log, some.data(), some.size()); got > 0)
      text.append(some.data(), static_cast<std::size_t>(got));
    return contains(text, "ready: frames on ");
  }));
}

std::vector<std::string> words_of(const std::string& program, const Bench& bench) {
  if (program == LBEA_RECORD)
    return {program, bench.file("run.mcap"), "--frames", bench.frames(), "--record-memory", "16", "--json"};
  return {program,           LBEA_MODEL, "--frames", bench.frames(),         "--results", bench.results(),
          "--record-memory", "16",       "--record", bench.file("run.mcap"), "--json"};
}

}  // namespace

TEST_CASE(
    "a log whose reader goes away in mid-test ends neither matcher nor recorder, and the recording is completed") {
  for (const std::string program : {LBEA_SERVE, LBEA_RECORD}) {
    CAPTURE(program);
    const Bench bench;
    const std::string pipe = bench.file("pipe");
    REQUIRE(::mkfifo(pipe.c_str(), 0600) == 0);
    const int reader = ::open(pipe.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    Process process(words_of(program, bench), pipe, pipe);
    wait_until_ready(reader);
    ::close(reader);
    WireContext context;
    Camera camera(context, bench.frames());
    for (std::uint64_t id = 0; id < 5; ++id) camera.send(id);
    camera.end(5);
    std::this_thread::sleep_for(200ms);  // for the log line of the new session
    CHECK(stop(process) == 0);
    CHECK(bench.inspect("run.mcap", 0)["frames"] == 5);
  }
}

TEST_CASE("a stopped terminal (Ctrl-S) stops neither the results nor the end of the program") {
  const Bench bench;
  int controller = -1, terminal = -1;
  std::array<char, 64> name{};
  REQUIRE(::openpty(&controller, &terminal, name.data(), nullptr, nullptr) == 0);
  Process process(words_of(LBEA_SERVE, bench), name.data(), name.data());
  wait_until_ready(controller);
  REQUIRE(::tcflow(terminal, TCOOFF) == 0);
  WireContext context;
  ResultSource results(context, bench.results());
  REQUIRE(results.receive(30s));
  Camera camera(context, bench.frames());
  for (std::uint64_t id = 0; id < 10; ++id) camera.send(id);
  camera.end(10);
  WireResult result;
  std::uint64_t matched = 0;
  while (result.status != WireStatus::end_of_stream) {
    const auto message = results.receive(5s);
    REQUIRE(message);
    if (decode_result(*message, result) == WireStatus::ok && result.status == WireStatus::ok) ++matched;
  }
  CHECK(matched == 10);
  process.signal(SIGINT);
  CHECK(process.ends_within(30s));
  CHECK(process.wait() == 0);
  CHECK(bench.inspect("run.mcap", 0)["frames"] == 10);
  ::close(terminal);
  ::close(controller);
}
