// Runs a program as a user would and keeps what it said.
#pragma once

#include "tests/support/test_data.hpp"

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <thread>

#include <sys/wait.h>
#include <unistd.h>

namespace lbea::test {

struct Outcome {
  int exit_code = -1;  // -1: ended by a signal
  std::string out, err;
};

/// `command` is a shell's; it runs in `folder`. Interrupted (Ctrl-C) after `interrupt_after` unless that is 0.
inline Outcome run_program(const std::string& command, const std::filesystem::path& folder,
                           std::chrono::milliseconds interrupt_after = {}) {
  const TemporaryFolder said;
  const std::string line = "cd '" + folder.string() + "' && exec " + command + " >'" +
                           (said / "out").string() + "' 2>'" + (said / "err").string() + "'";
  const pid_t child = ::fork();
  if (child == 0) {
    ::execl("/bin/sh", "sh", "-c", line.c_str(), nullptr);
    ::_exit(127);
  }
  if (interrupt_after.count() > 0) {
    std::this_thread::sleep_for(interrupt_after);
    ::kill(child, SIGINT);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  const auto text_of = [](const std::filesystem::path& file) {
    std::ifstream in(file);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, text_of(said / "out"), text_of(said / "err")};
}

}  // namespace lbea::test
