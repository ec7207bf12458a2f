// Frames in, results out: a receiving, a matching and a publishing thread with bounded queues between them.
// Every capture ends in exactly one of: matched, rejected (by reason), dropped (by reason), and in one result.
#pragma once

#include "tools/serve/frame_matcher.hpp"
#include "tools/serve/frame_receiver.hpp"
#include "tools/serve/handover.hpp"
#include "tools/serve/pipeline_config.hpp"
#include "tools/serve/result_publisher.hpp"

#include <array>
#include <thread>

namespace lbea::tool {

class Pipeline {
 public:
  Pipeline(PipelineConfig config, MatchEngine& engine, wire::FrameSource frames, wire::ResultSink results);
  ~Pipeline();
  /// Stops receiving, takes in what has already arrived, finishes all of it and publishes the last results.
  void stop();
  // Any thread:
  [[nodiscard]] wire::Counters counters() const noexcept { return publisher_.counters(); }
  [[nodiscard]] wire::PeerCounts frame_peers() const noexcept { return receiver_.peers(); }
  [[nodiscard]] wire::PeerCounts result_peers() const noexcept { return publisher_.peers(); }
  [[nodiscard]] std::vector<wire::PeerVisit> frame_visits() { return receiver_.visits(); }
  [[nodiscard]] std::vector<wire::PeerVisit> result_visits() { return publisher_.visits(); }
  [[nodiscard]] std::size_t queue_used() const noexcept { return handover_.frames.used(); }
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return handover_.senders.load(); }
  [[nodiscard]] const LatencyHistogram& match_times() const noexcept { return publisher_.match_times(); }
  [[nodiscard]] const LatencyHistogram& total_times() const noexcept { return publisher_.total_times(); }
  /// The unchanging part of the state.
  [[nodiscard]] const wire::WireState& description() const noexcept { return config_.description; }
  /// How often receiver, matcher and publisher came round: each does at least every 100 ms, unless it hangs.
  using Rounds = std::array<std::uint64_t, 3>;
  [[nodiscard]] Rounds rounds() const noexcept { return {receiver_.rounds(), matcher_.rounds(), publisher_.rounds()}; }
  /// The id of the frame that the matcher works on, or worked on last.
  [[nodiscard]] std::uint64_t frame_in_work() const noexcept { return matcher_.frame_in_work(); }

 private:
  Handover handover_;
  const PipelineConfig config_;
  FrameReceiver receiver_;
  FrameMatcher matcher_;
  ResultPublisher publisher_;
  std::thread receiving_, matching_, publishing_;
};

}  // namespace lbea::tool
