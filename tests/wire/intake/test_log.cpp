// The log of a program whose standard error nobody reads for a while.
#include "tools/shared/intake/log.hpp"

#include <doctest/doctest.h>

#include <array>
#include <new>
#include <sstream>
#include <thread>

#include <unistd.h>

using lbea::tool::Log;

namespace {

struct Pipe {
  Pipe() { REQUIRE(::pipe(ends.data()) == 0); }
  [[nodiscard]] std::string read_all() const {
    std::string text(1 << 16, '\0');
    std::string all;
    for (ssize_t got = 1; got > 0;) {
      got = ::read(ends[0], text.data(), text.size());
      all.append(text, 0, static_cast<std::size_t>(std::max<ssize_t>(got, 0)));
    }
    return all;
  }
  std::array<int, 2> ends{};
};

struct WithoutMemory {};

}  // namespace

template <>
struct fmt::formatter<WithoutMemory> : fmt::formatter<int> {
  static auto format(WithoutMemory, fmt::format_context& context) -> decltype(context.out()) { throw std::bad_alloc(); }
};

TEST_CASE("lines that nobody reads are dropped and counted, and the caller never waits") {
  constexpr std::uint64_t lines = 5000;  // a pipe has room for 64 kB, about 1,000 of them
  const Pipe pipe;
  const std::uint64_t lost_before = lbea::tool::lost_log_lines();
  std::string text;
  std::thread reader;
  {
    const Log log("test", pipe.ends[1]);
    for (std::uint64_t i = 0; i < lines; ++i) lbea::tool::log_info("number {}", i);
    CHECK(lbea::tool::lost_log_lines() > lost_before);
    reader = std::thread([&] { text = pipe.read_all(); });
  }
  ::close(pipe.ends[1]);
  reader.join();
  ::close(pipe.ends[0]);
  std::uint64_t written = 0, told = 0;
  std::istringstream read(text);
  for (std::string line; std::getline(read, line);) {
    if (line.find("number ") != std::string::npos) ++written;
    if (const auto at = line.find(" lines of this log are lost"); at != std::string::npos)
      told += std::stoull(line.substr(line.rfind(' ', at - 1) + 1));
  }
  CHECK(written >= Log::lines_held);
  CHECK(told > 0);
  CHECK(written + told == lines);
}

TEST_CASE("without a reader, the end of the log does not wait for one") {
  const Pipe pipe;
  {
    const Log log("test", pipe.ends[1]);
    for (int i = 0; i < 5000; ++i) lbea::tool::log_info("{:200}", i);  // 1,024 of them do not fit into a pipe
  }
  CHECK(lbea::tool::lost_log_lines() > 0);
  ::close(pipe.ends[0]);
  const Log log("test", pipe.ends[1]);  // EPIPE, and no SIGPIPE
  ::close(pipe.ends[1]);
}

// Regression: the name in a peer's key file reached the terminal with its control characters.
TEST_CASE("a name in a line of the log cannot change the terminal or add a line") {
  const Pipe pipe;
  {
    const Log log("test", pipe.ends[1]);
    lbea::tool::log_warning("peer {}", "\x1b[2J\nall is well");
  }
  ::close(pipe.ends[1]);
  const std::string text = pipe.read_all();
  ::close(pipe.ends[0]);
  CHECK(text.find("peer \\x1b[2J\\x0aall is well\n") != std::string::npos);
  CHECK(text.find('\x1b') == std::string::npos);
}

// Regression: a program that could not allocate the line "recording to ..." ended, and left the file that it had begun.
TEST_CASE("a line for which there is no memory is counted as lost, and the program goes on") {
  const Pipe pipe;
  const std::uint64_t lost_before = lbea::tool::lost_log_lines();
  {
    const Log log("test", pipe.ends[1]);
    lbea::tool::log_info("recording to {}", WithoutMemory{});
    CHECK(lbea::tool::lost_log_lines() == lost_before + 1);
    lbea::tool::log_info("ready");
  }
  ::close(pipe.ends[1]);
  const std::string text = pipe.read_all();
  ::close(pipe.ends[0]);
  CHECK(text.find("ready") != std::string::npos);
  CHECK(text.find("recording to") == std::string::npos);
  CHECK(text.find(" 1 lines of this log are lost") != std::string::npos);
}
