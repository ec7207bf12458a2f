#include "tools/shared/cli/tool.hpp"

#include "tools/shared/system/process.hpp"
#include "tools/shared/text/printable.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <exception>
#include <filesystem>
#include <map>
#include <new>
#include <system_error>

namespace lbea::tool {
namespace {

thread_local bool has_run_out = false;  // an allocation of this thread has failed
[[noreturn]] void note_no_memory() {
  has_run_out = true;
  throw std::bad_alloc();
}
[[maybe_unused]] const std::new_handler without_handler = std::set_new_handler(note_no_memory);

/// Whether an allocation failure ends the program. In an inlined noexcept function the current exception is not
/// available; then a failed allocation and an uncaught exception are the evidence.
bool is_out_of_memory() {
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) { return true; } catch (...) {
    return false;
  }
  return has_run_out && std::uncaught_exceptions() > 0;
}

[[noreturn]] void end();
const std::terminate_handler default_handler = std::set_terminate(end);

/// Memory may also run out where no handler is active: before run(), or in a noexcept thread function.
[[noreturn]] void end() {
  if (is_out_of_memory()) end_process("error: out of memory\n");
  default_handler();
  std::abort();
}

std::string sentence_of(const std::system_error& error) {
  if (error.code() != std::errc::resource_unavailable_try_again) return error.what();
  return "the system grants no further thread or process; end others, or raise the limit (ulimit -u, TasksMax=)";
}

/// Buffered output may still fail to be written. A reader that wants no more of it (head) is not a failure.
int flushed(int exit_code, const std::string& name) {
  if ((std::fflush(stdout) == 0 && std::ferror(stdout) == 0) || lost_its_reader()) return exit_code;
  std::fprintf(stderr, "%s: error: cannot write to standard output: %s\n", name.c_str(), std::strerror(errno));
  return exit_failed;
}

}  // namespace

volatile std::sig_atomic_t stop_requested = 0;

Tool::Tool(const std::string& name, const std::string& description, const std::string& example)
    : CommandLine(name, description, "Example:\n  " + example + "\n\nExit code: 0 ok, 1 failed, 2 wrong usage.") {}

void Tool::list_formats_by(const std::string& formats) {
  add_text_flag("--list-formats", formats, "the files that are read, and exit");
}

int Tool::run(int argc, char** argv, const std::function<int()>& body) {
  prepare_process();
  if (const auto parsed = parse(argc, argv)) return *parsed == 0 ? exit_ok : exit_usage;
  try {
    for (const auto& check : usage_checks_) check();
    return flushed(body(), program());
  } catch (const WrongUsage& wrong) {
    std::fprintf(stderr, "%s\nRun with --help for more information.\n", printable(wrong.what(), "\n").c_str());
    return exit_usage;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "%s: error: out of memory\n", program().c_str());
  } catch (const std::system_error& error) {
    std::fprintf(stderr, "%s: error: %s\n", program().c_str(), sentence_of(error).c_str());
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s: error: %s\n", program().c_str(), printable(error.what(), "\n").c_str());
  }
  return exit_failed;
}

namespace {
/// The same text for different spellings of an endpoint.
std::string canonical_endpoint(const std::string& address) {
  constexpr std::string_view ipc = "ipc://", local = "tcp://localhost:";
  if (address.starts_with(ipc)) {
    std::error_code error;
    const auto path = std::filesystem::weakly_canonical(address.substr(ipc.size()), error);
    return error ? address : std::string(ipc) + path.string();
  }
  return address.starts_with(local) ? "tcp://127.0.0.1:" + address.substr(local.size()) : address;
}
}  // namespace

void require_distinct_endpoints(const std::vector<std::pair<std::string, std::string>>& options) {
  std::map<std::string, std::string> owners;
  for (const auto& [name, address] : options) {
    if (address.empty() || address.ends_with(":*")) continue;
    const auto [owner, is_new] = owners.emplace(canonical_endpoint(address), name);
    if (!is_new)
      throw WrongUsage(owner->second + " and " + name + " are both \"" + address +
                       "\"; give each an endpoint of its own");
  }
}

void catch_stop_signals() {
  on_stop_request([] { stop_requested = 1; });
}

}  // namespace lbea::tool
