// What a program asks of the operating system: its arguments, the streams that it prints to, and how it is told to end.
// One implementation per system.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

/// Before anything is printed. A write beyond the file-size limit, or to a pipe without a reader, then fails with an
/// error; a mapped file that becomes shorter ends the program with a sentence. Lines end with "\n" on every system,
/// and waits are exact to about a millisecond.
void prepare_process();

/// The arguments after the program's name, in UTF-8.
[[nodiscard]] std::vector<std::string> arguments_of(int argc, char** argv);

/// Whether standard output is a pipe that nobody reads any more.
[[nodiscard]] bool lost_its_reader();

struct ProcessUse {
  std::uint64_t resident_bytes = 0;
  std::uint64_t descriptors = 0;  // on Windows: handles
};
[[nodiscard]] ProcessUse process_use();

/// Ends the program at once with exit code 1. Allowed in a signal handler.
[[noreturn]] void end_process(std::string_view sentence) noexcept;

/// Calls `stop`, perhaps on another thread, when the user or the system asks the program to end: Ctrl-C, a closed
/// terminal, SIGTERM.
void on_stop_request(void (*stop)());

}  // namespace lbea::tool
