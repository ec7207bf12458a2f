// What the receiving, the matching and the publishing threads share: the configuration, the bounded queues between
// them, and the account of the run. And the intake, which fills the queues.
#pragma once

#include "tools/serve/pipeline/capture_grouping.hpp"
#include "tools/shared/intake/channel.hpp"
#include "tools/shared/intake/frame_receiver.hpp"
#include "tools/shared/intake/run_observer.hpp"
#include "tools/shared/matching/match_engine.hpp"

#include <functional>

namespace lbea::tool {

/// One of several rigs.
struct PipelineRig {
  std::string name;
  std::int64_t clock_offset_ns = 0;  // added to the stamps of its frames, it gives those of the common clock
};

/// One of several components.
struct PipelineComponent {
  std::string name;
  std::uint64_t model_checksum = 0;
};

/// When the sender's clock shows the impact, and the longest time of a sample after it.
struct ExpectedImpact {
  std::int64_t trigger_ns = 0;
  double duration_s = 0;
};

struct PipelineConfig {
  wire::WireLimits limits;
  std::uint32_t queue_slots = 16;  // frames of a rig that may wait for the matcher; 1.5 MB each at 131,072 points
  std::uint32_t matchers = 1;      // matching threads; each has a frame beside the queue, but for one
  std::uint32_t max_matches = MatcherConfig{}.max_matches;
  std::chrono::milliseconds state_interval{500};
  std::chrono::milliseconds sender_timeout = IdTracker::default_sender_timeout;
  std::vector<PipelineRig> rigs{};                // empty: one
  GroupingConfig grouping{};                      // of the frames of several rigs
  std::vector<PipelineComponent> components{};    // empty: one
  bool one_sender = false;                        // see FrameReceiver::allow_one_sender
  double unidentified_results_per_second = 1000;  // results for messages without a readable id
  std::optional<ExpectedImpact> impact{};         // if it was given: stamps far from it are logged
  wire::WireState description;                    // the constant part: version, method, model
  /// Called once on each matching thread, with its number, before the first frame; may be empty.
  std::function<void(std::uint32_t)> on_matching_thread;
  RunObserver* observer = nullptr;  // optional; must outlive the pipeline

  [[nodiscard]] std::size_t rig_count() const noexcept { return std::max<std::size_t>(rigs.size(), 1); }
  [[nodiscard]] std::int64_t common_stamp_ns(std::uint32_t rig, std::int64_t stamp_ns) const noexcept {
    return tool::common_stamp_ns(stamp_ns, rig < rigs.size() ? rigs[rig].clock_offset_ns : 0);
  }
  static constexpr std::uint32_t slots_for_ends = 2;  // per rig of several, beside those for frames
  [[nodiscard]] std::size_t queue_capacity() const noexcept {
    return rigs.empty() ? std::size_t{queue_slots} + matchers - 1
                        : rigs.size() * (std::size_t{queue_slots} + slots_for_ends);
  }
};

struct FrameSlot {
  wire::FrameHeader header;   // without frame_id and cloud, which refer to the message
  std::vector<Point> points;  // max_points, of which header.points are filled
  std::int64_t receive_ns = 0;
  std::uint32_t rig = 0;
  std::uint32_t decode_ns = 0;
  std::chrono::steady_clock::time_point queued;
};

/// Sets which frame the result is of.
void name_frame(wire::WireResult& result, const FrameSlot& slot) noexcept;

struct PipelineQueues {
  /// Allocates all slots.
  explicit PipelineQueues(const PipelineConfig& config)
      : frames(config.queue_capacity(), &matcher_bell),
        outcomes(64, &publisher_bell),
        rejections(4096, &publisher_bell),
        rigs(config.rigs),
        accounts(config.rig_count()),
        queued(config.rig_count()),
        sessions(config.rig_count()) {
    for (FrameSlot& slot : frames.slots()) slot.points.resize(config.limits.max_points);
    for (Outcome& outcome : outcomes.slots()) reserve(outcome, config.max_matches);
  }
  /// The oldest frame has a status. Matching threads, one at a time.
  void release_frame() noexcept {
    --queued[frames.front()->rig];
    frames.release();
  }
  /// Of all rigs. Any thread.
  [[nodiscard]] wire::Counters counters() const noexcept;
  [[nodiscard]] std::vector<wire::WireSender> senders() const;
  void request_state() noexcept {
    state_requested = true;
    publisher_bell.ring();
  }

  Doorbell matcher_bell, publisher_bell;
  Channel<FrameSlot> frames;                           // receiver to matchers
  Channel<Outcome> outcomes;                           // matchers to publisher
  Channel<wire::WireResult> rejections;                // receiver to publisher: rejected and dropped frames
  std::vector<PipelineRig> rigs;                       // empty if there is only one
  std::vector<SharedAccount> accounts;                 // of each rig
  std::vector<std::atomic<std::uint32_t>> queued;      // frames of each rig in the queue
  std::vector<std::optional<std::uint64_t>> sessions;  // of each rig's latest frame; receiving thread
  std::atomic<bool> state_requested{false};            // publish a state before its regular time
};

/// The longest time that a thread waits without looking at its queues.
inline constexpr std::chrono::milliseconds max_idle{100};

/// A duration as results carry it: ns in 32 bits, at most 4.29 s.
[[nodiscard]] inline std::uint32_t short_ns(std::int64_t ns) noexcept {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(ns, 0, std::numeric_limits<std::uint32_t>::max()));
}

[[nodiscard]] inline std::uint32_t since_ns(std::chrono::steady_clock::time_point begin) noexcept {
  return short_ns((std::chrono::steady_clock::now() - begin) / std::chrono::nanoseconds(1));
}

/// Allows so many events per second, and as many at once after a pause.
class RateLimit {
 public:
  using Clock = std::chrono::steady_clock;
  explicit RateLimit(double per_second) : per_second_(per_second), left_(per_second) {}
  /// Whether one more is allowed now; counts it.
  [[nodiscard]] bool allows(Clock::time_point now) noexcept;

 private:
  double per_second_, left_;
  Clock::time_point last_{};
};

/// The receiving thread's, one per rig: puts received frames into the matcher's queue and rejections into the
/// publisher's. A capture that cannot be matched still gets a result; without room for it, the capture is counted as
/// unannounced.
class FrameEnqueuer final : public IntakeSink {
 public:
  FrameEnqueuer(const PipelineConfig& config, PipelineQueues& queues, std::uint32_t rig)
      : config_(config),
        rig_(rig),
        unidentified_limit_(config.unidentified_results_per_second),
        observer_(config.observer),
        queues_(queues) {}
  void on_frame(const ReceivedFrame& frame) noexcept override;
  void on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids,
                 std::int64_t receive_ns) noexcept override;
  void on_control(const wire::Control& control) noexcept override;

 private:
  void enqueue(FrameSlot& slot, const ReceivedFrame& frame) noexcept;
  [[nodiscard]] bool has_room() const noexcept;
  [[nodiscard]] bool is_new_end(const wire::FrameHeader& header) noexcept;
  [[nodiscard]] bool is_of_another_rig(std::uint64_t session) noexcept;
  void reject(wire::WireStatus status, const ReceivedFrame& frame) noexcept;
  void push_rejection(wire::WireStatus status, const wire::FrameHeader& header, std::int64_t receive_ns) noexcept;

  [[nodiscard]] SharedCounters& counters() noexcept { return queues_.accounts[rig_].counters; }

  const PipelineConfig& config_;
  std::uint32_t rig_;
  RateLimit unidentified_limit_;
  RunObserver* observer_;  // optional
  PipelineQueues& queues_;
  std::optional<std::pair<std::uint64_t, std::uint64_t>> latest_end_;  // session and id
};

}  // namespace lbea::tool
