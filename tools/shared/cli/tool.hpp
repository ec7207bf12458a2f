// What every program shares: --help with an example, --version, exit codes, Ctrl-C.
#pragma once

#include "tools/shared/cli/command_line.hpp"

#include <csignal>
#include <functional>
#include <initializer_list>
#include <stdexcept>
#include <string>
#include <utility>

namespace lbea::tool {

enum ExitCode : int { exit_ok = 0, exit_failed = 1, exit_usage = 2 };

/// Options that are valid alone but contradict each other; the text gives the reason and the remedy. Ends with
/// exit_usage.
struct WrongUsage : std::runtime_error {
  using std::runtime_error::runtime_error;
};

/// A command line with --version and an example under --help.
class Tool : public CommandLine {
 public:
  Tool(const std::string& name, const std::string& description, const std::string& example);
  /// --list-formats prints this text and ends the program; other options are ignored.
  void list_formats_by(const std::string& formats);
  /// Runs after the command line is read; throws WrongUsage when options contradict each other.
  void add_usage_check(std::function<void()> check) { usage_checks_.push_back(std::move(check)); }
  /// Parses, runs `body` and turns its outcome into an exit code: what body returns; 1 and one sentence on
  /// stderr for an exception, and when what was printed could not be written; 2 for a wrong command line.
  int run(int argc, char** argv, const std::function<int()>& body);

 private:
  std::vector<std::function<void()>> usage_checks_;
};

/// Refuses two options with the same endpoint, before the second bind fails with a less clear error. Options by name
/// with their addresses, empty when not given; "any free port" is never the same. Throws WrongUsage.
void require_distinct_endpoints(const std::vector<std::pair<std::string, std::string>>& options);

/// Set after catch_stop_signals() when the program shall end (see on_stop_request()): loops check it and end cleanly.
extern volatile std::sig_atomic_t stop_requested;
void catch_stop_signals();

}  // namespace lbea::tool
