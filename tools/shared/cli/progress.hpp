// A progress line on stderr: a moving bar on a terminal, a plain line now and then elsewhere.
#pragma once

#include "tools/shared/text/outlet.hpp"

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

#include <unistd.h>

namespace lbea::tool {

class Progress {
 public:
  /// total 0: unknown; the line then shows the count only.
  Progress(std::string label, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance_to(std::uint64_t done);

 private:
  void draw(std::uint64_t done);
  void show(const std::string& text) const;

  Outlet outlet_{STDERR_FILENO};
  std::string label_;
  std::uint64_t total_;
  std::uint64_t drawn_ = 0;
  bool on_terminal_;
  std::chrono::steady_clock::time_point begin_, last_;
};

/// One progress line per stage: a new stage begins a new line.
class StageProgress {
 public:
  void show(std::string_view stage, std::uint64_t done, std::uint64_t total) {
    if (!line_ || stage != stage_) line_.emplace(std::string(stage), total);
    stage_ = stage;
    line_->advance_to(done);
  }

 private:
  std::string stage_;
  std::optional<Progress> line_;
};

}  // namespace lbea::tool
