#include "tools/shared/system/process.hpp"

#include <csignal>
#include <filesystem>
#include <fstream>

#include <poll.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

void (*stop_program)() = nullptr;

/// A mapped file has become shorter, or its disk has failed.
[[noreturn]] void end_without_file(int) {
  end_process(
      "error: a file became shorter while it was read, or its disk failed; replace files by renaming others (mv)\n");
}

}  // namespace

void prepare_process() {
  std::signal(SIGXFSZ, SIG_IGN);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGBUS, end_without_file);
}

std::vector<std::string> arguments_of(int argc, char** argv) { return {argv + (argc > 0 ? 1 : 0), argv + argc}; }

bool lost_its_reader() {
  pollfd out{STDOUT_FILENO, POLLOUT, 0};
  return ::poll(&out, 1, 0) > 0 && (out.revents & (POLLERR | POLLHUP)) != 0;
}

ProcessUse process_use() {
  std::uint64_t pages = 0, resident = 0, descriptors = 0;
  std::ifstream("/proc/self/statm") >> pages >> resident;
  std::error_code ignored;
  for (auto entry = std::filesystem::directory_iterator("/proc/self/fd", ignored);
       entry != std::filesystem::directory_iterator(); entry.increment(ignored))
    ++descriptors;
  return {resident * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)), descriptors};
}

void end_process(std::string_view sentence) noexcept {
  static_cast<void>(!::write(STDERR_FILENO, sentence.data(), sentence.size()));
  ::_exit(1);
}

void on_stop_request(void (*stop)()) {
  stop_program = stop;
  struct sigaction action {};
  action.sa_handler = [](int) { stop_program(); };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // nohup ignores it
}

}  // namespace lbea::tool
