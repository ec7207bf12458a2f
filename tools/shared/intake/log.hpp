// The log of a program on standard error. A thread of its own writes it, so that a terminal that nobody reads (Ctrl-S,
// a hung connection) stops nothing else.
#pragma once

#include <spdlog/async.h>

#include <cstdint>
#include <memory>
#include <string>

#include <unistd.h>

namespace lbea::tool {

class LogWriter;

/// Replaces spdlog's default logger until the end of the scope.
class Log {
 public:
  static constexpr std::size_t lines_held = 1024;  // beyond it the oldest line is dropped and counted

  explicit Log(const std::string& program, int descriptor = STDERR_FILENO);
  /// Writes the lines held; waits for a reader for at most half a second.
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

 private:
  std::shared_ptr<spdlog::logger> before_;
  std::shared_ptr<LogWriter> writer_;
  std::shared_ptr<spdlog::details::thread_pool> thread_;
};

/// Lines that were dropped because nobody read them, or that could not be written. Any thread.
[[nodiscard]] std::uint64_t lost_log_lines();
/// Waits until the lines held are written, at most half a second.
void wait_for_log();

}  // namespace lbea::tool
