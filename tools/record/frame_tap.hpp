// Stands between a rig and its matcher: records what comes and passes it on, byte for byte.
#pragma once

#include "adapters/wire/id_tracker.hpp"
#include "adapters/wire/streams.hpp"
#include "tools/recording/run_recorder.hpp"

#include <atomic>
#include <optional>
#include <thread>

namespace lbea {

struct TapTally {
  std::uint64_t frames = 0;     // received
  std::uint64_t damaged = 0;    // of these: nothing in them could be recorded
  std::uint64_t forwarded = 0;
  std::uint64_t refused = 0;    // the matcher had no room for them
  std::uint64_t missed = 0;       // captures of which no frame arrived, as ids and the sender's words tell
  std::uint64_t silent = 0;        // senders gone without goodbye: what they held back is unknown
  std::uint64_t lost_results = 0;  // results and states that this subscriber did not get
};

/// Receives and forwards on one thread, listens to results on another.
class FrameTap {
 public:
  /// `forward` and `results` may be absent.
  FrameTap(FrameSource frames, std::optional<FrameSink> forward, std::optional<ResultSource> results, RunRecorder& recorder, WireLimits limits);
  ~FrameTap();
  /// Takes in what has arrived, then ends.
  void stop();
  [[nodiscard]] TapTally tally() const noexcept;
  /// After stop(): who sent.
  [[nodiscard]] const std::vector<WireSender>& senders() const noexcept { return senders_; }

 private:
  void take_frames() noexcept;
  void take(Message message) noexcept;
  bool take_words(Message message) noexcept;
  void take_results() noexcept;
  void note_sequence(std::uint64_t sequence) noexcept;

  FrameSource frames_;
  std::optional<FrameSink> forward_;
  std::optional<ResultSource> results_;
  RunRecorder& recorder_;
  FrameDecoder decoder_;
  IdTracker ids_;
  std::vector<WireSender> senders_;
  std::uint64_t next_sequence_ = 0;  // 0: none heard yet
  std::atomic<std::uint64_t> received_{0}, damaged_{0}, forwarded_{0}, refused_{0}, missed_{0}, silent_{0}, lost_results_{0};
  std::atomic<bool> stopping_{false};
  std::thread frames_thread_, results_thread_;
};

}  // namespace lbea
