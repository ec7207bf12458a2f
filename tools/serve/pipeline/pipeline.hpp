// Frames in, results out: a receiving, one or several matching and a publishing thread with bounded queues between
// them. Every capture ends in exactly one status: matched, rejected or dropped (by reason), and in one result.
#pragma once

#include "tools/serve/pipeline/capture_matcher.hpp"
#include "tools/serve/pipeline/component_matcher.hpp"
#include "tools/serve/pipeline/frame_matcher.hpp"
#include "tools/serve/pipeline/result_publisher.hpp"

#include <deque>
#include <thread>

namespace lbea::tool {

class Pipeline {
 public:
  /// The engine needs as many matchers as `config`.
  Pipeline(PipelineConfig config, MatchEngine& engine, wire::FrameSource frames, wire::ResultSink results);
  /// Several rigs: as many engine's rigs and `frames` as `config` has.
  Pipeline(PipelineConfig config, RigEngine& engine, std::vector<wire::FrameSource> frames, wire::ResultSink results);
  /// Several components of one rig: as many as `config` has.
  Pipeline(PipelineConfig config, ComponentEngine& engine, wire::FrameSource frames, wire::ResultSink results);
  ~Pipeline();
  /// Stops receiving, takes in what has already arrived, matches all of it and publishes the last results.
  void stop();
  /// Logs what has happened since the last call. One thread.
  void write_log() { publisher_.write_log(); }
  // Any thread:
  [[nodiscard]] wire::Counters counters() const noexcept { return publisher_.counters(); }
  /// Of each of several rigs; otherwise empty.
  [[nodiscard]] std::vector<wire::WireRig> rigs() const { return publisher_.rigs(); }
  [[nodiscard]] wire::PeerCounts frame_peers() const noexcept;  // of all rigs
  [[nodiscard]] wire::PeerCounts result_peers() const noexcept { return publisher_.peers(); }
  [[nodiscard]] std::vector<PeerLog> peer_logs();
  [[nodiscard]] std::size_t queue_used() const noexcept { return queues_.frames.used(); }
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return queues_.senders(); }
  [[nodiscard]] const LatencyHistogram& match_times() const noexcept { return publisher_.match_times(); }
  [[nodiscard]] const LatencyHistogram& total_times() const noexcept { return publisher_.total_times(); }
  [[nodiscard]] LatestChannels::Frame latest_channels(std::size_t component = 0) const {
    return publisher_.latest_channels(component);
  }
  /// The constant part of the state.
  [[nodiscard]] const wire::WireState& description() const noexcept { return config_.description; }
  /// Loop counts of receiver, matchers and publisher: each rises at least every 100 ms unless its thread hangs.
  using Rounds = std::array<std::uint64_t, 3>;
  [[nodiscard]] Rounds rounds() const noexcept {
    return {rigs_.front().receiver.rounds(), matching_rounds(), publisher_.rounds()};
  }
  /// The id of the oldest frame that is being matched, or of the one that was matched last.
  [[nodiscard]] std::uint64_t current_frame() const noexcept {
    return matcher_ ? matcher_->current_frame() : captures_ ? captures_->current_frame() : components_->current_frame();
  }

 private:
  struct Rig {
    Rig(wire::FrameSource frames, const PipelineConfig& config, PipelineQueues& queues, std::uint32_t number);
    FrameEnqueuer enqueuer;
    FrameReceiver receiver;
  };
  Pipeline(PipelineConfig config, std::vector<const TestEngine*> tests, std::vector<wire::FrameSource> frames,
           wire::ResultSink results);
  [[nodiscard]] std::uint64_t matching_rounds() const noexcept {
    return matcher_ ? matcher_->rounds() : captures_ ? captures_->rounds() : components_->rounds();
  }
  void start();
  void receive() noexcept;

  PipelineQueues queues_;
  const PipelineConfig config_;
  std::deque<Rig> rigs_;
  std::optional<FrameMatcher> matcher_;     // of one rig
  std::optional<CaptureMatcher> captures_;  // of several
  std::optional<ComponentMatcher> components_;
  ResultPublisher publisher_;
  std::thread receiving_, publishing_;
  std::vector<std::thread> matching_;
};

}  // namespace lbea::tool
