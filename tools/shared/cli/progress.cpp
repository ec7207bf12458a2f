#include "tools/shared/cli/progress.hpp"

#include <algorithm>
#include <cstdio>

#include <unistd.h>

namespace lbea::tool {
namespace {
constexpr auto terminal_interval = std::chrono::milliseconds(50);
constexpr auto plain_interval = std::chrono::seconds(5);
constexpr int bar_width = 30;
}  // namespace

Progress::Progress(std::string label, std::uint64_t total)
    : label_(std::move(label)),
      total_(total),
      on_terminal_(isatty(STDERR_FILENO) != 0),
      begin_(std::chrono::steady_clock::now()),
      last_(begin_) {}

Progress::~Progress() {
  if (on_terminal_ && drawn_ > 0) std::fputc('\n', stderr);
}

void Progress::advance_to(std::uint64_t done) {
  const auto now = std::chrono::steady_clock::now();
  const bool due = now - last_ >= (on_terminal_ ? std::chrono::milliseconds(terminal_interval)
                                                : std::chrono::milliseconds(plain_interval));
  const bool just_finished = total_ > 0 && done >= total_ && drawn_ > 0 && drawn_ < total_;
  if (!due && !just_finished) return;
  last_ = now;
  draw(total_ > 0 ? std::min(done, total_) : done);
}

void Progress::draw(std::uint64_t done) {
  drawn_ = std::max<std::uint64_t>(done, 1);
  const double seconds = std::chrono::duration<double>(last_ - begin_).count();
  if (total_ == 0) {
    std::fprintf(stderr, on_terminal_ ? "\r%s: %llu  %.0f s" : "%s: %llu (%.0f s)\n", label_.c_str(),
                 static_cast<unsigned long long>(done), seconds);
    std::fflush(stderr);
    return;
  }
  const double share = static_cast<double>(done) / static_cast<double>(total_);
  if (!on_terminal_) {
    std::fprintf(stderr, "%s: %llu of %llu (%.0f s)\n", label_.c_str(), static_cast<unsigned long long>(done),
                 static_cast<unsigned long long>(total_), seconds);
    return;
  }
  const int filled = static_cast<int>(share * bar_width);
  std::fprintf(stderr, "\r%s [%.*s%*s] %3.0f %%  %.0f s", label_.c_str(), filled, "##############################",
               bar_width - filled, "", 100 * share, seconds);
  std::fflush(stderr);
}

}  // namespace lbea::tool
