// One rig's frames: received, recorded and forwarded, without waiting for the matcher.
#pragma once

#include "tools/record/forwarder.hpp"
#include "tools/record/record_tally.hpp"
#include "tools/shared/intake/frame_log.hpp"
#include "tools/shared/intake/frame_receiver.hpp"
#include "tools/shared/recording/run_recorder.hpp"

#include <atomic>

namespace lbea::tool {

/// A rig with its sockets.
struct ForwardedRig {
  std::string name;  // empty: the only one
  std::int64_t clock_offset_ns = 0;
  wire::FrameSource frames;
  std::optional<wire::FrameSink> forward{};
};

class RigIntake final : private IntakeSink {
 public:
  RigIntake(ForwardedRig rig, std::uint32_t number, RunRecorder& recorder, wire::WireLimits limits);

  [[nodiscard]] FrameReceiver& receiver() noexcept { return receiver_; }
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  /// After the receiver has ended: waits up to `timeout` until everything has left this process.
  void finish(std::chrono::milliseconds timeout);
  /// delivered: what the matcher's states tell; empty without any. Final after finish().
  [[nodiscard]] RecordTally tally(const DeliveredFrames& delivered) const;
  /// The senders; at most 100 ms old, and final after the receiver has ended.
  [[nodiscard]] std::vector<wire::WireSender> senders() const { return account_.senders.load(); }
  /// Logs what has happened since the last call. One thread.
  void write_log();

 private:
  void on_frame(const ReceivedFrame& frame) noexcept override;
  void on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids, std::int64_t) noexcept override {
    log_.note(status, session, ids);
  }
  void on_control(const wire::Control& control) noexcept override {
    if (forward_) forward_->send_control({control});
  }
  void on_idle() noexcept override {
    if (forward_) forward_->send_pending();
  }
  void record(const ReceivedFrame& frame) noexcept;
  [[nodiscard]] std::uint64_t undelivered(const DeliveredFrames& delivered) const;

  std::string name_;
  std::uint32_t number_;
  std::int64_t clock_offset_ns_;
  std::optional<Forwarder> forward_;
  RunRecorder& recorder_;
  SharedAccount account_;
  FrameReceiver receiver_;
  std::atomic<std::uint64_t> damaged_{0}, too_many_points_{0}, forwarded_{0}, refused_{0};
  Forwarder::LeftOver left_over_;  // after finish()
  FrameLog log_;
  PeerLog peers_;
};

}  // namespace lbea::tool
