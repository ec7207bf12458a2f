// The publishing thread: every outcome and refusal as a result, and from time to time the state of it all.
#pragma once

#include "adapters/wire/codec/codec.hpp"
#include "adapters/wire/sockets/streams.hpp"
#include "tools/serve/handover.hpp"
#include "tools/serve/latency_histogram.hpp"
#include "tools/shared/intake/frame_log.hpp"

#include <atomic>
#include <chrono>

namespace lbea::tool {

class ResultPublisher {
 public:
  /// `config` outlives it.
  ResultPublisher(const PipelineConfig& config, const MatchEngine& engine, wire::ResultSink sink, Handover& handover);
  /// Until the matcher is done and everything is published.
  void run() noexcept;
  // Any thread:
  /// As a result published now has them.
  [[nodiscard]] wire::Counters counters() const noexcept;
  [[nodiscard]] wire::PeerCounts peers() const noexcept { return sink_.peers(); }
  [[nodiscard]] std::vector<wire::PeerVisit> visits() { return sink_.visits(); }
  [[nodiscard]] const LatencyHistogram& match_times() const noexcept { return match_times_; }
  [[nodiscard]] const LatencyHistogram& total_times() const noexcept { return total_times_; }
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  using Clock = std::chrono::steady_clock;
  bool publish_waiting() noexcept;
  bool publish_refusals() noexcept;
  void publish(const Outcome& outcome) noexcept;
  void publish(const wire::WireResult& refusal) noexcept;
  void send_result() noexcept;
  void note_times(const wire::WireTimes& times) noexcept;
  void publish_state() noexcept;

  const PipelineConfig& config_;
  const MatchEngine& engine_;
  wire::ResultSink sink_;
  Handover& handover_;
  wire::Encoder encoder_;
  FrameLog log_;
  wire::WireResult result_;
  wire::WireState state_;
  std::uint64_t sequence_ = 0;
  LatencyHistogram match_times_, total_times_;
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
