// Runs programs and collects their output.
#pragma once

#include "tests/support/files.hpp"
#include "tests/support/test_data.hpp"

#include <chrono>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <string>
#include <thread>
#include <vector>

#include <sys/wait.h>
#include <unistd.h>

namespace lbea::test {

/// A program that runs in the background; killed at the end of the scope if it still runs.
class Process {
 public:
  /// Output goes to the files, which are created.
  Process(std::vector<std::string> arguments, const std::string& out, const std::string& err) {
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::fflush(stdout);  // otherwise both processes print the buffered text
    pid_ = ::fork();
    if (pid_ != 0) return;
    const bool redirected = std::freopen(out.c_str(), "w", stdout) && std::freopen(err.c_str(), "w", stderr);
    if (redirected) ::execv(argv[0], argv.data());
    ::_exit(127);
  }
  ~Process() {
    if (pid_ <= 0) return;
    ::kill(pid_, SIGKILL);
    static_cast<void>(wait());
  }
  Process(const Process&) = delete;
  Process& operator=(const Process&) = delete;

  void signal(int number) const {
    if (pid_ > 0) ::kill(pid_, number);  // 0 would also signal this test
  }
  [[nodiscard]] pid_t id() const noexcept { return pid_; }
  [[nodiscard]] bool is_running() {
    if (pid_ <= 0) return false;
    if (::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = 0;
    return pid_ != 0;
  }
  /// Whether it ends within `limit`; otherwise it is killed.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds limit) {
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (is_running() && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const bool has_ended = !is_running();
    signal(SIGKILL);
    return has_ended;
  }
  /// The exit code; 128 + signal when a signal ended it.
  [[nodiscard]] int wait() {
    if (pid_ > 0) ::waitpid(pid_, &status_, 0);
    pid_ = 0;
    return WIFEXITED(status_) ? WEXITSTATUS(status_) : 128 + WTERMSIG(status_);
  }

 private:
  pid_t pid_ = 0;
  int status_ = 0;
};

struct Outcome {
  int exit_code = 0;  // 128 + signal when a signal ended it
  std::string out{}, err{};
};

/// Waits for the end of a process whose output goes to `out` and `err` in this folder. After `limit`, unless that is 0,
/// it is killed, and a line in `err` says so.
inline Outcome outcome_of(Process& process, const TemporaryFolder& output, std::chrono::milliseconds limit) {
  const bool is_killed = limit.count() > 0 && !process.ends_within(limit);
  const int exit_code = process.wait();
  const std::string notice =
      is_killed ? "killed, because it still ran after " + std::to_string(limit.count()) + " ms\n" : "";
  return {exit_code, text_of(output / "out"), text_of(output / "err") + notice};
}

/// Runs a shell command in `folder`. It is interrupted (Ctrl-C) after `interrupt_after` unless that is 0, and killed
/// after another `limit` unless that is 0.
inline Outcome run_program(const std::string& command, const std::filesystem::path& folder,
                           std::chrono::milliseconds interrupt_after = {}, std::chrono::milliseconds limit = {}) {
  const TemporaryFolder output;
  Process process({"/bin/sh", "-c", "cd '" + folder.string() + "' && exec " + command}, output / "out", output / "err");
  if (interrupt_after.count() > 0) {
    std::this_thread::sleep_for(interrupt_after);
    process.signal(SIGINT);
  }
  return outcome_of(process, output, limit);
}

}  // namespace lbea::test
