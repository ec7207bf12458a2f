#include "tools/record/rig_intake.hpp"

#include <algorithm>

namespace lbea::tool {

RigIntake::RigIntake(ForwardedRig rig, std::uint32_t number, RunRecorder& recorder, wire::WireLimits limits)
    : name_(std::move(rig.name)),
      number_(number),
      clock_offset_ns_(rig.clock_offset_ns),
      recorder_(recorder),
      receiver_(std::move(rig.frames), limits, IdTracker::default_sender_timeout, account_, *this),
      log_(name_),
      peers_(name_.empty() ? "frames" : "frames of " + name_, receiver_) {
  if (rig.forward) forward_.emplace(std::move(*rig.forward));
}

void RigIntake::finish(std::chrono::milliseconds timeout) {
  if (forward_) left_over_ = forward_->finish(timeout);
}

RecordTally RigIntake::tally(const DeliveredFrames& delivered) const {
  const wire::Counters counters = account_.counters.load();
  const std::uint64_t withheld = counters.of(wire::WireStatus::withheld);
  return {.received = counters.received,
          .damaged = damaged_,
          .too_many_points = too_many_points_,
          .forwarded = forwarded_,
          .refused = refused_,
          .undelivered = undelivered(delivered),
          .missed = counters.missed + withheld,
          .withheld = withheld,
          .silent = counters.silent,
          .interleaved = counters.interleaved,
          .unforwarded_controls = left_over_.controls};
}

void RigIntake::write_log() {
  log_.write();
  log_.write(senders());
  log_.write(account_.counters.load());
  peers_.poll(PeerLog::Clock::now());
}

void RigIntake::on_frame(const ReceivedFrame& frame) noexcept {
  const wire::FrameHeader& header = frame.decoder.header();
  const IdRange id{header.id, 1};
  if (frame.status == wire::WireStatus::end_of_stream) {
    log_.note(frame.status, header.session, id);
    if (forward_) forward_->send_control({{header.session, wire::ControlKind::goodbye, header.id, 0}, true});
    return;
  }
  const bool is_refused = forward_ && !forward_->send(frame.message);
  record(frame);
  log_.note(frame.status, header.session, id);
  if (!forward_) return;
  ++(is_refused ? refused_ : forwarded_);
  if (is_refused) log_.note_refusal(header.session, id);
}

/// Records every frame with a point cloud, whatever its status.
void RigIntake::record(const ReceivedFrame& frame) noexcept {
  const wire::FrameHeader& header = frame.decoder.header();
  if (frame.status == wire::WireStatus::ok)
    recorder_.frame_of_test(common_stamp_ns(header.stamp_ns, clock_offset_ns_), frame.receive_ns);
  recorder_.frame(frame.message, header, {frame.receive_ns, number_});
  if (header.cloud.empty()) ++damaged_;
  if (frame.message_status == wire::WireStatus::too_many_points) ++too_many_points_;
}

/// A broken connection loses frames that were forwarded: the matcher's states tell how many it received.
std::uint64_t RigIntake::undelivered(const DeliveredFrames& delivered) const {
  if (!forward_) return 0;
  if (delivered.empty()) return left_over_.frames;
  const std::uint64_t missing = delivered.missing_of(senders());
  return missing - std::min(missing, refused_.load());
}

}  // namespace lbea::tool
