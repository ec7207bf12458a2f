// Stands between a rig and its matcher: records what comes and passes it on, byte for byte.
#pragma once

#include "adapters/wire/sockets/streams.hpp"
#include "tools/record/forwarder.hpp"
#include "tools/record/tap_log.hpp"
#include "tools/shared/intake/id_tracker.hpp"
#include "tools/shared/intake/shared_counters.hpp"
#include "tools/shared/recording/run_recorder.hpp"

#include <atomic>
#include <optional>
#include <thread>

namespace lbea::tool {

struct TapTally {
  std::uint64_t frames = 0;           // received
  std::uint64_t damaged = 0;          // of these: nothing in them could be recorded
  std::uint64_t too_many_points = 0;  // of these: recorded, and more than a matcher will take
  std::uint64_t forwarded = 0;
  std::uint64_t refused = 0;       // the matcher had no room for them
  std::uint64_t missed = 0;        // captures of which no frame arrived, as ids and the sender's words tell
  std::uint64_t withheld = 0;      // of these: their sender found no room
  std::uint64_t silent = 0;        // senders gone without goodbye: what they held back is unknown
  std::uint64_t lost_results = 0;  // results and states that this subscriber did not get
  std::uint64_t untold = 0;        // after stop(): what senders said that the matcher did not take
  /// Every capture is in a frame that came, and the matcher has it too.
  [[nodiscard]] bool is_complete() const noexcept {
    return damaged == 0 && refused == 0 && missed == 0 && silent == 0 && lost_results == 0;
  }
};

/// Receives and forwards on one thread, which waits for nobody; listens to results on another.
class FrameTap {
 public:
  /// `forward` and `results` may be absent.
  FrameTap(wire::FrameSource frames, std::optional<wire::FrameSink> forward, std::optional<wire::ResultSource> results,
           RunRecorder& recorder, wire::WireLimits limits);
  ~FrameTap();
  /// Takes in what has arrived, then ends.
  void stop();
  [[nodiscard]] TapTally tally() const noexcept;
  /// Who sends, as of a moment ago; after stop(): who sent.
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return senders_.load(); }
  /// One thread's to read.
  [[nodiscard]] TapEvents& events() noexcept { return events_; }

 private:
  using Clock = IdTracker::Clock;

  void take_frames() noexcept;
  bool take_next(std::chrono::milliseconds timeout) noexcept;
  void take(wire::Message message) noexcept;
  void take_frame(wire::Message message, wire::WireStatus status, std::int64_t receive_ns) noexcept;
  bool hear(const SenderWord& word) noexcept;
  void note(TapEvent::Kind kind, wire::WireStatus status, std::uint64_t session, IdRange ids) noexcept;
  void show_senders(Clock::time_point now, Clock::duration patience) noexcept;
  void take_results() noexcept;
  void note_sequence(std::uint64_t sequence) noexcept;

  wire::FrameSource frames_;
  std::optional<Forwarder> forward_;
  std::optional<wire::ResultSource> results_;
  RunRecorder& recorder_;
  wire::FrameDecoder decoder_;
  IdTracker ids_;
  TapEvents events_{1024};
  SharedSenders senders_;
  Clock::time_point next_show_{};
  std::uint64_t known_sessions_ = 0;
  std::uint64_t next_sequence_ = 0;  // 0: none heard yet
  std::atomic<std::uint64_t> received_{0}, damaged_{0}, too_many_points_{0}, forwarded_{0}, refused_{0}, missed_{0},
      withheld_{0}, silent_{0}, lost_results_{0}, untold_{0};
  std::atomic<bool> stopping_{false};
  std::thread frames_thread_, results_thread_;
};

}  // namespace lbea::tool
