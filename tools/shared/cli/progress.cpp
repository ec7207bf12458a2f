#include "tools/shared/cli/progress.hpp"

#include "tools/shared/text/formatted.hpp"

#include <algorithm>

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
  if (on_terminal_ && drawn_ > 0) show("\n");
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
  const auto count = static_cast<unsigned long long>(done), total = static_cast<unsigned long long>(total_);
  if (total_ == 0)
    return show(formatted(on_terminal_ ? "\r%s: %llu  %.0f s" : "%s: %llu (%.0f s)\n", label_.c_str(), count, seconds));
  if (!on_terminal_) return show(formatted("%s: %llu of %llu (%.0f s)\n", label_.c_str(), count, total, seconds));
  const double share = static_cast<double>(done) / static_cast<double>(total_);
  const int filled = static_cast<int>(share * bar_width);
  show(formatted("\r%s [%.*s%*s] %3.0f %%  %.0f s", label_.c_str(), filled, "##############################",
                 bar_width - filled, "", 100 * share, seconds));
}

/// A terminal that nobody reads must not stop the work.
void Progress::show(const std::string& text) const {
  outlet_.write(text, [] { return true; });
}

}  // namespace lbea::tool
