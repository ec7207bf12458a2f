// Health of the chain: rates, latencies, losses, and the time since the last message.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <nlohmann/json_fwd.hpp>

#include <chrono>
#include <deque>
#include <map>
#include <optional>

namespace lbea::tool {

/// Frames per second, between two times about a second apart.
class FrameRate {
 public:
  using Clock = std::chrono::steady_clock;
  void add(Clock::time_point now);
  [[nodiscard]] double per_second(Clock::time_point now) const;

 private:
  Clock::time_point begin_{};
  std::uint64_t count_ = 0;
  double rate_ = 0;
};

class Health {
 public:
  using Clock = std::chrono::steady_clock;
  void add(const wire::WireResult& result, Clock::time_point now = Clock::now());
  /// Of another component than the first one that is shown.
  void add_other(const wire::WireResult& result);
  void add(const wire::WireState& state, Clock::time_point now = Clock::now());
  void add_unreadable() noexcept { ++unreadable_; }
  [[nodiscard]] nlohmann::json report(Clock::time_point now = Clock::now()) const;

  /// Edges of the latency histogram: bin i holds up to first_edge_ms * 2^(i/2), the last one everything above.
  static constexpr std::size_t bins = 24;
  static constexpr double first_edge_ms = 0.25;

 private:
  using Histogram = std::array<std::uint64_t, bins>;
  static constexpr std::chrono::seconds window{5};  // the histogram covers the last two
  void count_lost(std::uint64_t sequence);
  void turn_windows(Clock::time_point now);
  void add_size(const wire::WireRecording& recording, Clock::time_point now);
  [[nodiscard]] nlohmann::json recording_report() const;

  /// One of several rigs.
  struct Rig {
    wire::WireRigFrame latest;
    Clock::time_point last_frame{};
    FrameRate rate;
  };
  [[nodiscard]] nlohmann::json rig_reports(Clock::time_point now) const;

  /// Of the recording.
  struct Size {
    Clock::time_point time;
    std::uint64_t bytes = 0;
  };
  std::optional<wire::WireState> state_;
  std::deque<Size> sizes_;  // of the last seconds
  wire::Counters counters_;
  Histogram current_{}, previous_{};
  Clock::time_point window_begin_{}, last_message_{}, last_frame_{};
  std::optional<std::uint64_t> sequence_;
  std::uint64_t lost_ = 0, unreadable_ = 0;
  FrameRate rate_;
  std::map<std::string, Rig> rigs_;  // by name
};

}  // namespace lbea::tool
