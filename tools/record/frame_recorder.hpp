// lbea-record between a rig and its matcher: records frames and forwards them byte for byte.
#pragma once

#include "tools/record/forwarder.hpp"
#include "tools/shared/intake/frame_log.hpp"
#include "tools/shared/intake/frame_receiver.hpp"
#include "tools/shared/recording/run_recorder.hpp"

#include <atomic>
#include <optional>
#include <thread>

namespace lbea::tool {

struct RecordTally {
  std::uint64_t received = 0;         // frames
  std::uint64_t damaged = 0;          // of these: without a point cloud that can be recorded
  std::uint64_t too_many_points = 0;  // of these: recorded, but larger than a matcher accepts
  std::uint64_t forwarded = 0;
  std::uint64_t refused = 0;               // not forwarded: the matcher had no room
  std::uint64_t missed = 0;                // captures of which no frame arrived, withheld ones included
  std::uint64_t withheld = 0;              // of these: their sender had no room
  std::uint64_t silent = 0;                // senders that stopped without goodbye: what they withheld is unknown
  std::uint64_t interleaved = 0;           // returns to a sender while the test of another one was running
  std::uint64_t lost_results = 0;          // results and states that this subscriber missed
  std::uint64_t unforwarded_controls = 0;  // after stop(): control messages that the matcher did not accept
  /// Every capture of one test arrived as a frame, and reached the matcher too.
  [[nodiscard]] bool is_complete() const noexcept {
    return damaged == 0 && refused == 0 && missed == 0 && silent == 0 && interleaved == 0 && lost_results == 0;
  }
};

/// Receives, records and forwards on one thread, which never waits for the matcher; receives results on another.
class FrameRecorder final : private IntakeSink {
 public:
  /// `forward` and `results` are optional.
  FrameRecorder(wire::FrameSource frames, std::optional<wire::FrameSink> forward,
                std::optional<wire::ResultSource> results, RunRecorder& recorder, wire::WireLimits limits);
  ~FrameRecorder() override;
  /// Takes in what has arrived, then ends.
  void stop();
  [[nodiscard]] RecordTally tally() const noexcept;
  /// The senders; at most 100 ms old, and final after stop().
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return account_.senders.load(); }
  /// Logs what has happened since the last call. One thread.
  void write_log();

 private:
  void on_frame(const ReceivedFrame& frame) noexcept override;
  void on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids,
                 std::int64_t receive_ns) noexcept override;
  void on_control(const wire::Control& control) noexcept override;
  void on_idle() noexcept override;
  void record(const ReceivedFrame& frame) noexcept;
  void receive_frames() noexcept;
  void receive_results() noexcept;
  void count_sequence(std::uint64_t sequence) noexcept;

  std::optional<Forwarder> forward_;
  std::optional<wire::ResultSource> results_;
  RunRecorder& recorder_;
  SharedAccount account_;
  FrameReceiver receiver_;
  std::uint64_t next_sequence_ = 0;  // 0: none received yet
  std::atomic<std::uint64_t> damaged_{0}, too_many_points_{0}, forwarded_{0}, refused_{0}, lost_results_{0},
      unforwarded_controls_{0};
  std::atomic<bool> stopping_{false};
  FrameLog log_;
  PeerLog peers_{"frames", receiver_};
  std::thread frames_thread_, results_thread_;
};

}  // namespace lbea::tool
