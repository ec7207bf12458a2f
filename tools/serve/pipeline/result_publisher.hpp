// The publishing thread: publishes every outcome and rejection as a result, and the state at intervals.
#pragma once

#include "tools/serve/pipeline/latest_channels.hpp"
#include "tools/serve/pipeline/pipeline_queues.hpp"
#include "tools/shared/answer/test_answer.hpp"
#include "tools/shared/intake/frame_log.hpp"

#include <atomic>
#include <deque>

namespace lbea::tool {

/// Durations counted between fixed bounds; written by one thread, read by any.
class LatencyHistogram {
 public:
  /// Upper bounds in s; the last bucket has none.
  static constexpr std::array<double, 13> bounds_s{5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3,
                                                   1e-2, 2e-2, 5e-2, 0.1,  0.5,  1};
  using Counts = std::array<std::uint64_t, bounds_s.size() + 1>;

  void add(std::uint64_t ns) noexcept;
  [[nodiscard]] Counts counts() const noexcept;
  [[nodiscard]] double sum_s() const noexcept {
    return static_cast<double>(sum_ns_.load(std::memory_order_relaxed)) * 1e-9;
  }

 private:
  std::array<std::atomic<std::uint64_t>, bounds_s.size() + 1> counts_{};
  std::atomic<std::uint64_t> sum_ns_{0};
};

class ResultPublisher {
 public:
  /// `config` must outlive the publisher. `tests`: of each component.
  ResultPublisher(const PipelineConfig& config, std::vector<const TestEngine*> tests, wire::ResultSink sink,
                  PipelineQueues& queues);
  /// Runs until the queue of outcomes is closed and everything is published.
  void run() noexcept;
  /// Logs what has happened since the last call. One other thread.
  void write_log();
  // Any thread:
  /// The counters as a result published now would carry them.
  [[nodiscard]] wire::Counters counters() const noexcept;
  /// Of each of several rigs; otherwise empty.
  [[nodiscard]] std::vector<wire::WireRig> rigs() const;
  [[nodiscard]] wire::PeerCounts peers() const noexcept { return sink_.peers(); }
  [[nodiscard]] std::vector<wire::PeerVisit> visits() { return sink_.visits(); }
  [[nodiscard]] const LatencyHistogram& match_times() const noexcept { return match_times_; }
  [[nodiscard]] const LatencyHistogram& total_times() const noexcept { return total_times_; }
  [[nodiscard]] LatestChannels::Frame latest_channels(std::size_t component) const {
    return channels_[component].load();
  }
  [[nodiscard]] std::uint64_t rounds() const noexcept { return rounds_.load(std::memory_order_relaxed); }

 private:
  using Clock = std::chrono::steady_clock;
  bool publish_queued() noexcept;
  bool publish_rejections() noexcept;
  [[nodiscard]] bool has_component(const Outcome& outcome) const noexcept;
  [[nodiscard]] std::uint64_t checksum_of_frames() const noexcept;
  void send_of_frame() noexcept;
  void send_of_component(const Outcome& outcome) noexcept;
  void send_result() noexcept;
  void note_component(std::size_t component) noexcept;
  [[nodiscard]] std::string_view named_rig(std::string_view name) const noexcept;
  void note_rig_use() noexcept;
  void note_frame() noexcept;
  void note_far_stamp() noexcept;
  void note_clocks() noexcept;
  void add_times(const wire::WireTimes& times) noexcept;
  void publish_state() noexcept;

  const PipelineConfig& config_;
  const std::vector<const TestEngine*> tests_;  // of each component
  wire::ResultSink sink_;
  PipelineQueues& queues_;
  wire::Encoder encoder_;
  FrameLog log_;
  std::vector<UndeformedCoverage> undeformed_;  // of each component
  std::vector<DepartedPoints> departed_;        // of each component
  CaptureTimes times_;
  CaptureTimes::Problem noted_times_ = CaptureTimes::Problem::none;
  RigUse rig_use_;
  bool is_unused_noted_ = false, is_contradiction_noted_ = false;
  std::optional<std::uint64_t> session_;        // of the latest matched frame
  std::vector<std::int64_t> logged_clocks_ns_;  // of each of several rigs
  wire::WireResult result_;
  StageTimes slowest_;  // of the components of the frame
  wire::WireState state_;
  std::uint64_t sequence_ = 0;
  LatencyHistogram match_times_, total_times_;
  std::deque<LatestChannels> channels_;  // of each component
  std::atomic<std::uint64_t> rounds_{0};
};

}  // namespace lbea::tool
