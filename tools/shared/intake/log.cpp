#include "tools/shared/intake/log.hpp"

#include "tools/shared/text/outlet.hpp"
#include "tools/shared/text/printable.hpp"

#include <spdlog/async.h>
#include <spdlog/details/null_mutex.h>
#include <spdlog/details/os.h>
#include <spdlog/sinks/base_sink.h>
#include <spdlog/spdlog.h>

#include <atomic>
#include <chrono>
#include <limits>
#include <string_view>
#include <thread>

namespace lbea::tool {
namespace {

using Clock = std::chrono::steady_clock;
constexpr auto longest_wait = std::chrono::milliseconds(500);

std::atomic<std::uint64_t> unwritten{0};
std::atomic<spdlog::details::thread_pool*> log_thread{nullptr};

/// The terminal's code for the color of a level; as spdlog's own sinks have them.
std::string_view color_of(spdlog::level::level_enum level) {
  if (level >= spdlog::level::err) return "\033[31m\033[1m";
  return level == spdlog::level::warn ? "\033[33m\033[1m" : "\033[32m";
}

spdlog::level::level_enum level_of(LogLevel level) {
  switch (level) {
    case LogLevel::info:
      return spdlog::level::info;
    case LogLevel::warning:
      return spdlog::level::warn;
    case LogLevel::error:
      break;
  }
  return spdlog::level::err;
}

}  // namespace

/// Writes lines on the log's thread.
class LogSink final : public spdlog::sinks::base_sink<spdlog::details::null_mutex> {
 public:
  explicit LogSink(int descriptor)
      : outlet_(descriptor), has_colors_(::isatty(descriptor) != 0 && spdlog::details::os::is_color_terminal()) {}
  /// From this time on, lines without a reader are dropped.
  void end_at(Clock::time_point time) { end_ = time.time_since_epoch().count(); }

 private:
  void sink_it_(const spdlog::details::log_msg& message) override {
    if (const std::uint64_t lost = lost_log_lines(); lost != told_ && write_loss(message, lost - told_)) told_ = lost;
    if (!write(message)) ++unwritten;
  }
  void flush_() override {}

  bool write_loss(const spdlog::details::log_msg& next, std::uint64_t lines) {
    const std::string text =
        std::to_string(lines) + " lines of this log are lost: they were not read in time, or memory was short";
    return write({next.logger_name, spdlog::level::warn, text});
  }
  bool write(spdlog::details::log_msg message) {
    const std::string text = printable({message.payload.data(), message.payload.size()});
    message.payload = text;
    spdlog::memory_buf_t buffer;
    formatter_->format(message, buffer);
    std::string line(buffer.data(), buffer.size());
    if (has_colors_)
      line.insert(message.color_range_end, "\033[m").insert(message.color_range_start, color_of(message.level));
    return outlet_.write(line, [this] { return Clock::now().time_since_epoch().count() > end_; });
  }

  Outlet outlet_;
  bool has_colors_;
  std::atomic<Clock::rep> end_{std::numeric_limits<Clock::rep>::max()};
  std::uint64_t told_ = lost_log_lines();
};

/// Replaces spdlog's default logger.
class Log::Writer {
 public:
  Writer(const std::string& program, int descriptor)
      : before_(spdlog::default_logger()),
        sink_(std::make_shared<LogSink>(descriptor)),
        thread_(std::make_shared<spdlog::details::thread_pool>(lines_held, 1)) {
    log_thread = thread_.get();
    auto logger =
        std::make_shared<spdlog::async_logger>(program, sink_, thread_, spdlog::async_overflow_policy::overrun_oldest);
    logger->set_error_handler([](const std::string&) { ++unwritten; });
    spdlog::set_default_logger(std::move(logger));
  }
  ~Writer() {
    sink_->end_at(Clock::now() + longest_wait);
    spdlog::set_default_logger(before_);
    thread_.reset();  // ends it after the lines held
    log_thread = nullptr;
  }
  Writer(const Writer&) = delete;
  Writer& operator=(const Writer&) = delete;

 private:
  std::shared_ptr<spdlog::logger> before_;
  std::shared_ptr<LogSink> sink_;
  std::shared_ptr<spdlog::details::thread_pool> thread_;
};

Log::Log(const std::string& program, int descriptor) : writer_(std::make_unique<Writer>(program, descriptor)) {}

Log::~Log() = default;

void write_log(LogLevel level, fmt::string_view pattern, fmt::format_args values) noexcept {
  try {
    spdlog::log(level_of(level), fmt::vformat(pattern, values));
  } catch (...) { ++unwritten; }
}

std::uint64_t lost_log_lines() {
  spdlog::details::thread_pool* const thread = log_thread;
  return unwritten + (thread != nullptr ? thread->overrun_counter() : 0);
}

void wait_for_log() {
  spdlog::details::thread_pool* const thread = log_thread;
  const auto deadline = Clock::now() + longest_wait;
  while (thread != nullptr && thread->queue_size() > 0 && Clock::now() < deadline)
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace lbea::tool
