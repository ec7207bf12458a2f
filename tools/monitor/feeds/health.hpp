// How the chain is doing: rates, latencies, what was lost and since when nothing came.
#pragma once

#include "adapters/wire/codec/messages.hpp"

#include <nlohmann/json_fwd.hpp>

#include <array>
#include <chrono>
#include <cstdint>
#include <deque>
#include <optional>

namespace lbea::tool {

class Health {
 public:
  using Clock = std::chrono::steady_clock;
  void note(const wire::WireResult& result, Clock::time_point now = Clock::now());
  void note(const wire::WireState& state, Clock::time_point now = Clock::now());
  void note_unreadable() noexcept { ++unreadable_; }
  [[nodiscard]] nlohmann::json report(Clock::time_point now = Clock::now()) const;

  /// Edges of the latency histogram: bin i holds up to first_edge_ms * 2^(i/2), the last one everything above.
  static constexpr std::size_t bins = 24;
  static constexpr double first_edge_ms = 0.25;

 private:
  using Histogram = std::array<std::uint64_t, bins>;
  static constexpr std::chrono::seconds window{5};  // two of them make the histogram: what happened lately
  void note_sequence(std::uint64_t sequence, std::int64_t publish_ns);
  void turn_windows(Clock::time_point now);
  void note_recording(const wire::WireRecording& recording, Clock::time_point now);
  [[nodiscard]] nlohmann::json recording_report() const;

  /// How large the recording was.
  struct Size {
    Clock::time_point time;
    std::uint64_t bytes = 0;
  };
  std::optional<wire::WireState> state_;
  std::deque<Size> sizes_;  // of the last seconds
  wire::Counters counters_;
  Histogram current_{}, previous_{};
  Clock::time_point window_begin_{}, heard_{}, last_frame_{};
  std::optional<std::uint64_t> sequence_;
  std::uint64_t lost_ = 0, unreadable_ = 0;
  // rate: frames between two moments about a second apart
  Clock::time_point rate_begin_{};
  std::uint64_t rate_count_ = 0;
  double rate_ = 0;
};

}  // namespace lbea::tool
