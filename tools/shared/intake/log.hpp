// The log of a program on standard error. A thread of its own writes it, so that a terminal that nobody reads (Ctrl-S,
// a hung connection) stops nothing else.
#pragma once

#include <fmt/core.h>

#include <cstdint>
#include <memory>
#include <string>

#include <unistd.h>

namespace lbea::tool {

enum class LogLevel : std::uint8_t { info, warning, error };

/// Writes a line to the log, or to standard output where there is no Log. A line that cannot be formatted, because
/// memory is short, is counted as lost. Any thread.
void write_log(LogLevel level, fmt::string_view pattern, fmt::format_args values) noexcept;

/// The same with a pattern of fmt, which the compiler checks.
template <class... Values>
void log_info(fmt::format_string<Values...> pattern, Values&&... values) {
  write_log(LogLevel::info, pattern, fmt::make_format_args(values...));
}
template <class... Values>
void log_warning(fmt::format_string<Values...> pattern, Values&&... values) {
  write_log(LogLevel::warning, pattern, fmt::make_format_args(values...));
}
template <class... Values>
void log_error(fmt::format_string<Values...> pattern, Values&&... values) {
  write_log(LogLevel::error, pattern, fmt::make_format_args(values...));
}

/// Receives the lines of the log until the end of the scope.
class Log {
 public:
  static constexpr std::size_t lines_held = 1024;  // beyond it the oldest line is dropped and counted

  explicit Log(const std::string& program, int descriptor = STDERR_FILENO);
  /// Writes the lines held; waits for a reader for at most half a second.
  ~Log();
  Log(const Log&) = delete;
  Log& operator=(const Log&) = delete;

 private:
  class Writer;
  std::unique_ptr<Writer> writer_;
};

/// Lines that were dropped because nobody read them, or that could not be formatted or written. Any thread.
[[nodiscard]] std::uint64_t lost_log_lines();
/// Waits until the lines held are written, at most half a second.
void wait_for_log();

}  // namespace lbea::tool
