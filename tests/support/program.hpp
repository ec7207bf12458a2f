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

/// `command` is a shell's; it runs in `folder`. Interrupted (Ctrl-C) after `interrupt_after` unless that is 0.
inline Outcome run_program(const std::string& command, const std::filesystem::path& folder,
                           std::chrono::milliseconds interrupt_after = {}) {
  const TemporaryFolder said;
  Process process({"/bin/sh", "-c", "cd '" + folder.string() + "' && exec " + command}, said / "out", said / "err");
  if (interrupt_after.count() > 0) {
    std::this_thread::sleep_for(interrupt_after);
    process.signal(SIGINT);
  }
  const int exit_code = process.wait();
  return {exit_code, text_of(said / "out"), text_of(said / "err")};
}

}  // namespace lbea::test
