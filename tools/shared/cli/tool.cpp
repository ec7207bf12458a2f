#include "tools/shared/cli/tool.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <exception>
#include <limits>
#include <new>
#include <string_view>
#include <system_error>

#include <unistd.h>

namespace lbea::tool {
namespace {

thread_local bool has_run_out = false;  // of memory, at some time
[[noreturn]] void note_no_memory() {
  has_run_out = true;
  throw std::bad_alloc();
}
[[maybe_unused]] const std::new_handler without_handler = std::set_new_handler(note_no_memory);

/// What ends the program. Where a function that must not throw was put into another one the compiler no longer says
/// what was thrown, only that something was.
bool is_want_of_memory() {
  try {
    if (const auto thrown = std::current_exception()) std::rethrow_exception(thrown);
  } catch (const std::bad_alloc&) { return true; } catch (...) {
    return false;
  }
  return has_run_out && std::uncaught_exceptions() > 0;
}

[[noreturn]] void end();
const std::terminate_handler default_handler = std::set_terminate(end);

/// Memory may also run out where nobody can catch it: before run(), in a thread that must not throw.
[[noreturn]] void end() {
  constexpr char sentence[] = "error: out of memory\n";
  if (is_want_of_memory()) {
    static_cast<void>(!::write(STDERR_FILENO, sentence, sizeof(sentence) - 1));
    ::_exit(exit_failed);
  }
  default_handler();
  std::abort();
}

std::string sentence_of(const std::system_error& error) {
  if (error.code() != std::errc::resource_unavailable_try_again) return error.what();
  return "the system grants no further thread or process; end others, or raise the limit (ulimit -u, TasksMax=)";
}

/// What was printed may still be on its way.
int flushed(int exit_code, const std::string& name) {
  if (std::fflush(stdout) == 0 && std::ferror(stdout) == 0) return exit_code;
  std::fprintf(stderr, "%s: error: cannot write to standard output: %s\n", name.c_str(), std::strerror(errno));
  return exit_failed;
}

/// The library reads 010 as eight, and what does not fit as the largest that does.
bool is_decimal_integer(std::string_view text, bool is_signed) {
  const std::string_view digits = text.substr(text.starts_with('-') || text.starts_with('+') ? 1 : 0);
  if (digits.size() > 1 && digits.starts_with('0')) return false;
  const char* const end = digits.data() + digits.size();
  std::int64_t within = 0;
  std::uint64_t value = 0;
  if (is_signed && text.starts_with('-'))
    return std::from_chars(text.data(), end, within) == std::from_chars_result{end, std::errc{}};
  const auto [read, error] = std::from_chars(digits.data(), end, value);
  return read == end && error == std::errc{} &&
         (!is_signed || value <= std::uint64_t{std::numeric_limits<std::int64_t>::max()});
}

/// The library's ranges let through what compares with nothing.
void refuse_what_is_no_number(const CLI::App& app) {
  for (const CLI::Option* option : app.get_options()) {
    const std::string type = option->get_type_name();
    for (const std::string& text : option->results()) {
      if (double value = 0;
          type.starts_with("FLOAT") && CLI::detail::lexical_cast(text, value) && !std::isfinite(value))
        throw CLI::ValidationError(option->get_name(), "\"" + text + "\" is not a finite number");
      if ((type.starts_with("INT") || type.starts_with("UINT")) && !is_decimal_integer(text, type.starts_with("INT")))
        throw CLI::ValidationError(
            option->get_name(), "\"" + text + "\" is not a whole number that fits, in decimals without leading zeros");
    }
  }
  for (const CLI::App* command : app.get_subcommands()) refuse_what_is_no_number(*command);
}

}  // namespace

volatile std::sig_atomic_t stop_requested = 0;

Tool::Tool(std::string name, std::string description, std::string example)
    : CLI::App(std::move(description), std::move(name)) {
  set_version_flag("--version", get_name() + " " LBEA_VERSION_STRING);
  footer("Example:\n  " + std::move(example) + "\n\nExit code: 0 ok, 1 failed, 2 wrong usage.");
  option_defaults()->always_capture_default();
}

void Tool::list_formats_by(const std::string& formats) {
  add_flag_callback(
      "--list-formats", [formats] { throw CLI::CallForVersion(formats, CLI::ExitCodes::Success); },
      "the files that are read, and exit");
}

int Tool::run(int argc, char** argv, const std::function<int()>& body) {
  try {
    parse(argc, argv);
    refuse_what_is_no_number(*this);
  } catch (const CLI::ParseError& error) { return exit(error) == 0 ? exit_ok : exit_usage; }
  // A file-size limit is a failed write with a sentence, not a signal.
  std::signal(SIGXFSZ, SIG_IGN);
  try {
    return flushed(body(), get_name());
  } catch (const WrongUsage& wrong) {
    std::fprintf(stderr, "%s\nRun with --help for more information.\n", wrong.what());
    return exit_usage;
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "%s: error: out of memory\n", get_name().c_str());
  } catch (const std::system_error& error) {
    std::fprintf(stderr, "%s: error: %s\n", get_name().c_str(), sentence_of(error).c_str());
  } catch (const std::exception& error) { std::fprintf(stderr, "%s: error: %s\n", get_name().c_str(), error.what()); }
  return exit_failed;
}

void catch_stop_signals() {
  struct sigaction action {};
  action.sa_handler = [](int) { stop_requested = 1; };
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction hangup {};
  sigaction(SIGHUP, nullptr, &hangup);
  if (hangup.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // nohup's wish
}

}  // namespace lbea::tool
