// A progress line on stderr: a moving bar on a terminal, a plain line now and then elsewhere.
#pragma once

#include <chrono>
#include <cstdint>
#include <string>

namespace lbea::tool {

class Progress {
 public:
  /// total 0: nobody knows how much there is; then what is done is counted.
  Progress(std::string label, std::uint64_t total);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;
  void advance_to(std::uint64_t done);

 private:
  void draw(std::uint64_t done);
  std::string label_;
  std::uint64_t total_;
  std::uint64_t drawn_ = 0;
  bool on_terminal_;
  std::chrono::steady_clock::time_point begin_, last_;
};

}  // namespace lbea::tool
