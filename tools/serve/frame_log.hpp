// What the operator reads while frames come in: one line per kind of trouble and second, however much there is.
#pragma once

#include "adapters/wire/messages.hpp"

#include <chrono>

namespace lbea {

class FrameLog {
 public:
  /// A result about to be published.
  void note(const WireResult& result);
  /// A state about to be published.
  void note(const WireState& state);

 private:
  using Clock = std::chrono::steady_clock;
  struct Line {
    Clock::time_point last{};
    std::uint64_t untold = 0;
  };
  /// Whether a line may be written now; counts it as untold otherwise.
  static bool may_speak(Line& line);
  void note_trouble(const WireResult& result);
  void note_session(const WireResult& result);

  std::array<Line, wire_status_count> by_status_{};
  Line senders_;
  std::uint64_t session_ = 0;
  std::vector<WireSender> known_;
};

}  // namespace lbea
