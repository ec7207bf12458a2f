// Runs programs as a user would and keeps what they said.
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

/// A program run beside the test; killed at the end of the scope if it still runs.
class Process {
 public:
  /// Output goes to the files, which are created.
  Process(std::vector<std::string> arguments, const std::string& out, const std::string& err) {
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    argv.push_back(nullptr);
    std::fflush(stdout);  // what waits there would be said by both
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
    if (pid_ > 0) ::kill(pid_, number);  // 0 would be this test, too
  }
  [[nodiscard]] bool is_running() {
    if (pid_ <= 0) return false;
    if (::waitpid(pid_, &status_, WNOHANG) == pid_) pid_ = 0;
    return pid_ != 0;
  }
  /// Whether it ends by itself before `limit` is over; it is killed otherwise.
  [[nodiscard]] bool ends_within(std::chrono::milliseconds limit) {
    const auto deadline = std::chrono::steady_clock::now() + limit;
    while (is_running() && std::chrono::steady_clock::now() < deadline)
      std::this_thread::sleep_for(std::chrono::milliseconds(1));
    const bool has_ended = !is_running();
    signal(SIGKILL);
    return has_ended;
  }
  /// The exit code; 128 + signal when one ended it.
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
  int exit_code = 0;  // 128 + signal when one ended it
  std::string out{}, err{};
};

/// Waits for the end of what says `out` and `err` in that folder. What still runs after `limit`, unless that is 0, is
/// killed, and its last words say so.
inline Outcome outcome_of(Process& process, const TemporaryFolder& said, std::chrono::milliseconds limit) {
  const bool is_killed = limit.count() > 0 && !process.ends_within(limit);
  const int exit_code = process.wait();
  const std::string last_words =
      is_killed ? "killed, because it still ran after " + std::to_string(limit.count()) + " ms\n" : "";
  return {exit_code, text_of(said / "out"), text_of(said / "err") + last_words};
}

/// `command` is a shell's; it runs in `folder`. Interrupted (Ctrl-C) after `interrupt_after` unless that is 0; killed
/// after another `limit` unless that is 0.
inline Outcome run_program(const std::string& command, const std::filesystem::path& folder,
                           std::chrono::milliseconds interrupt_after = {}, std::chrono::milliseconds limit = {}) {
  const TemporaryFolder said;
  Process process({"/bin/sh", "-c", "cd '" + folder.string() + "' && exec " + command}, said / "out", said / "err");
  if (interrupt_after.count() > 0) {
    std::this_thread::sleep_for(interrupt_after);
    process.signal(SIGINT);
  }
  return outcome_of(process, said, limit);
}

}  // namespace lbea::test
