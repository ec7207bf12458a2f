// Frames in, results out: a receiving, one or several matching and a publishing thread with bounded queues between
// them. Every capture ends in exactly one status: matched, rejected or dropped (by reason), and in one result.
#pragma once

#include "tools/serve/pipeline/frame_matcher.hpp"
#include "tools/serve/pipeline/result_publisher.hpp"

#include <thread>

namespace lbea::tool {

class Pipeline {
 public:
  /// The engine needs as many matchers as `config`.
  Pipeline(PipelineConfig config, MatchEngine& engine, wire::FrameSource frames, wire::ResultSink results);
  ~Pipeline();
  /// Stops receiving, takes in what has already arrived, matches all of it and publishes the last results.
  void stop();
  /// Logs what has happened since the last call. One thread.
  void write_log() { publisher_.write_log(); }
  // Any thread:
  [[nodiscard]] wire::Counters counters() const noexcept { return publisher_.counters(); }
  [[nodiscard]] wire::PeerCounts frame_peers() const noexcept { return receiver_.peers(); }
  [[nodiscard]] wire::PeerCounts result_peers() const noexcept { return publisher_.peers(); }
  [[nodiscard]] std::vector<PeerLog> peer_logs() { return {{"frames", receiver_}, {"results", publisher_}}; }
  [[nodiscard]] std::size_t queue_used() const noexcept { return queues_.frames.used(); }
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return queues_.account.senders.load(); }
  [[nodiscard]] const LatencyHistogram& match_times() const noexcept { return publisher_.match_times(); }
  [[nodiscard]] const LatencyHistogram& total_times() const noexcept { return publisher_.total_times(); }
  [[nodiscard]] LatestChannels::Frame latest_channels() const { return publisher_.latest_channels(); }
  /// The constant part of the state.
  [[nodiscard]] const wire::WireState& description() const noexcept { return config_.description; }
  /// Loop counts of receiver, matchers and publisher: each rises at least every 100 ms unless its thread hangs.
  using Rounds = std::array<std::uint64_t, 3>;
  [[nodiscard]] Rounds rounds() const noexcept { return {receiver_.rounds(), matcher_.rounds(), publisher_.rounds()}; }
  /// The id of the oldest frame that is being matched, or of the one that was matched last.
  [[nodiscard]] std::uint64_t current_frame() const noexcept { return matcher_.current_frame(); }

 private:
  PipelineQueues queues_;
  const PipelineConfig config_;
  FrameEnqueuer enqueuer_;
  FrameReceiver receiver_;
  FrameMatcher matcher_;
  ResultPublisher publisher_;
  std::thread receiving_, publishing_;
  std::vector<std::thread> matching_;
};

}  // namespace lbea::tool
