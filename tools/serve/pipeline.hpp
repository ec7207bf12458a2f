// Frames in, results out: a receiving, a matching and a publishing thread with bounded queues between them.
// Every capture ends in exactly one of: matched, rejected (by reason), dropped (by reason), and in one result.
#pragma once

#include "adapters/wire/codec.hpp"
#include "adapters/wire/id_tracker.hpp"
#include "adapters/wire/spsc_ring.hpp"
#include "adapters/wire/streams.hpp"
#include "tools/serve/frame_log.hpp"
#include "tools/serve/latency_histogram.hpp"
#include "tools/serve/match_engine.hpp"
#include "tools/serve/outcome.hpp"
#include "tools/serve/rate_limit.hpp"
#include "tools/serve/run_observer.hpp"
#include "tools/serve/shared_counters.hpp"

#include <atomic>
#include <functional>
#include <thread>

namespace lbea {

struct PipelineConfig {
  WireLimits limits;
  std::uint32_t queue_slots = 16;  // frames that may wait for the matcher; 1.5 MB each at 131,072 points
  std::uint32_t max_matches = MatcherConfig{}.max_matches;
  std::chrono::milliseconds state_interval{500};
  std::chrono::milliseconds sender_patience{3000};  // without a word a sender is silent after so long
  double stray_results_per_second = 1000;           // results for messages that are nobody's frame
  WireState description;  // the unchanging part: version, method, model
  std::function<void()> on_matching_thread;  // called there once, before the first frame; may be empty
  RunObserver* observer = nullptr;  // may be absent; outlives the pipeline
};

class Pipeline {
 public:
  Pipeline(PipelineConfig config, MatchEngine& engine, FrameSource frames, ResultSink results);
  ~Pipeline();
  /// Stops receiving, takes in what has already arrived, finishes all of it and publishes the last results.
  void stop();
  [[nodiscard]] Counters counters() const noexcept;
  // Any thread:
  [[nodiscard]] PeerCounts frame_peers() const noexcept { return source_.peers(); }
  [[nodiscard]] PeerCounts result_peers() const noexcept { return sink_.peers(); }
  [[nodiscard]] std::size_t queue_used() const noexcept {
    const std::size_t used = frames_.used();  // may be read between two moves of the others
    return used > frames_.capacity() ? 0 : used;
  }
  [[nodiscard]] const LatencyHistogram& match_times() const noexcept { return match_times_; }
  [[nodiscard]] const LatencyHistogram& total_times() const noexcept { return total_times_; }
  /// The unchanging part of the state.
  [[nodiscard]] const WireState& description() const noexcept { return config_.description; }
  /// How often receiver, matcher and publisher came round: each does at least every 100 ms, unless it hangs.
  using Rounds = std::array<std::uint64_t, 3>;
  [[nodiscard]] Rounds rounds() const noexcept;
  /// The id of the frame that the matcher works on, or worked on last.
  [[nodiscard]] std::uint64_t frame_in_work() const noexcept { return frame_in_work_.load(std::memory_order_relaxed); }

 private:
  using Clock = std::chrono::steady_clock;

  struct FrameSlot {
    FrameHeader header;
    std::vector<Point> points;  // max_points, of which header.points are filled
    std::int64_t receive_ns = 0;
    std::uint32_t decode_ns = 0;
    Clock::time_point queued;
  };

  // receiving thread
  void receive_frames() noexcept;
  void take(Message message, bool patient) noexcept;
  bool take_control(Message message, std::int64_t receive_ns) noexcept;
  void take_frame(Message message, bool patient, std::int64_t receive_ns) noexcept;
  [[nodiscard]] WireStatus note_id(WireStatus status, std::int64_t receive_ns) noexcept;
  void accept(FrameSlot& slot, Clock::time_point begin, std::int64_t receive_ns) noexcept;
  void refuse(WireStatus status, std::int64_t receive_ns) noexcept;
  void announce(WireStatus status, const FrameHeader& header, std::int64_t receive_ns) noexcept;
  void announce(WireStatus status, std::uint64_t session, IdRange ids, std::int64_t receive_ns) noexcept;
  void note_senders(Clock::time_point now) noexcept;
  FrameSlot* claim_slot(bool patient) noexcept;
  // matching thread
  void match_frames() noexcept;
  void match(FrameSlot& slot) noexcept;
  void fill(Outcome& outcome, FrameSlot& slot) noexcept;
  // publishing thread
  void publish_results() noexcept;
  bool publish_waiting() noexcept;
  bool publish_refusals() noexcept;
  void publish(const Outcome& outcome) noexcept;
  void publish(const WireResult& refusal) noexcept;
  void send_published() noexcept;
  void publish_state() noexcept;

  PipelineConfig config_;
  MatchEngine& engine_;
  FrameSource source_;
  ResultSink sink_;

  SpscRing<FrameSlot> frames_;     // receiver to matcher
  SpscRing<Outcome> outcomes_;     // matcher to publisher
  SpscRing<WireResult> refusals_;  // receiver to publisher: rejected and dropped frames
  LatencyHistogram match_times_, total_times_;  // publisher's
  std::array<std::atomic<std::uint64_t>, 3> rounds_{};
  std::atomic<std::uint64_t> frame_in_work_{0};
  Doorbell frame_bell_, result_bell_;
  SharedCounters counters_;
  SharedSenders senders_;
  std::atomic<bool> stopping_{false}, receiver_done_{false}, matcher_done_{false};
  std::atomic<bool> state_wanted_{false};

  std::uint64_t matched_session_ = 0;  // matcher's
  FrameDecoder decoder_;  // receiver's
  IdTracker ids_;         // receiver's
  RateLimit stray_limit_;  // receiver's
  Clock::time_point next_note_{};  // receiver's
  Encoder encoder_;       // publisher's
  FrameLog log_;          // publisher's
  WireResult published_;  // publisher's
  WireState state_;  // publisher's
  std::uint64_t sequence_ = 0;
  std::thread receiver_, matcher_, publisher_;
};

}  // namespace lbea
