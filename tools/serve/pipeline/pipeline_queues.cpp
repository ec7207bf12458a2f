#include "tools/serve/pipeline/pipeline_queues.hpp"

namespace lbea::tool {

void name_frame(wire::WireResult& result, const FrameSlot& slot) noexcept {
  result.session = slot.header.session;
  result.frame_id = slot.header.id;
  result.stamp_ns = slot.header.stamp_ns;
  result.receive_ns = slot.receive_ns;
}

wire::Counters PipelineQueues::counters() const noexcept {
  wire::Counters sum;
  for (const SharedAccount& account : accounts) sum += account.counters.load();
  return sum;
}

std::vector<wire::WireSender> PipelineQueues::senders() const {
  std::vector<wire::WireSender> all;
  for (std::size_t rig = 0; rig < accounts.size(); ++rig)
    for (wire::WireSender& sender : accounts[rig].senders.load()) {
      if (!rigs.empty()) sender.rig = rigs[rig].name;
      all.push_back(std::move(sender));
    }
  return all;
}

constexpr std::uint64_t max_announced = 1000;  // results for one gap; the rest is only counted

bool RateLimit::allows(Clock::time_point now) noexcept {
  const double seconds = std::chrono::duration<double>(now - last_).count();
  left_ = std::min(per_second_, left_ + std::max(0.0, seconds) * per_second_);
  last_ = now;
  if (left_ < 1) return false;
  left_ -= 1;
  return true;
}

void FrameEnqueuer::on_frame(const ReceivedFrame& frame) noexcept {
  const bool is_end = frame.status == wire::WireStatus::end_of_stream;
  const wire::FrameHeader& header = frame.decoder.header();
  if (is_end && !is_new_end(header)) return;
  if (frame.status == wire::WireStatus::ok && is_of_another_rig(header.session)) {
    reject(wire::WireStatus::duplicate, frame);
    return;
  }
  if (frame.status != wire::WireStatus::ok && !is_end) {
    reject(frame.status, frame);
  } else if (is_end || frame.is_draining) {
    enqueue(queues_.frames.wait_and_claim(), frame);
  } else if (FrameSlot* slot = has_room() ? queues_.frames.claim() : nullptr) {
    enqueue(*slot, frame);
  } else {
    reject(wire::WireStatus::queue_full, frame);
  }
  // After the matcher has its copy, so that it does not wait for the observer's.
  if (observer_ == nullptr) return;
  if (frame.status == wire::WireStatus::ok && config_.rigs.empty())
    observer_->frame_of_test(header.stamp_ns, frame.receive_ns);
  observer_->frame(frame.message, header, {frame.receive_ns, rig_});
}

void FrameEnqueuer::on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids,
                              std::int64_t receive_ns) noexcept {
  const std::uint64_t announced = std::min(ids.count, max_announced);
  wire::FrameHeader header;
  header.session = session;
  for (header.id = ids.first; header.id - ids.first < announced; ++header.id)
    push_rejection(status, header, receive_ns);
  if (ids.count > announced) counters().count_unannounced(ids.count - announced);
}

void FrameEnqueuer::on_control(const wire::Control& control) noexcept {
  if (control.kind != wire::ControlKind::heartbeat) queues_.request_state();
}

void FrameEnqueuer::enqueue(FrameSlot& slot, const ReceivedFrame& frame) noexcept {
  slot.header = frame.decoder.header();
  slot.header.frame_id = {};
  slot.header.cloud = {};
  frame.decoder.read_points(slot.points);
  slot.receive_ns = frame.receive_ns;
  slot.rig = rig_;
  slot.queued = RateLimit::Clock::now();
  slot.decode_ns = since_ns(frame.begin);
  ++queues_.queued[rig_];
  queues_.frames.publish();
}

/// Whether the rig has not used up its share of the queue.
bool FrameEnqueuer::has_room() const noexcept {
  return config_.rigs.empty() || queues_.queued[rig_] < config_.queue_slots;
}

/// With several rigs, repeated ends, and more of them than there is room for, are ignored: the others would wait.
bool FrameEnqueuer::is_new_end(const wire::FrameHeader& header) noexcept {
  if (config_.rigs.empty()) return true;
  const std::pair end{header.session, header.id};
  return queues_.queued[rig_] < config_.queue_slots + PipelineConfig::slots_for_ends &&
         std::exchange(latest_end_, end) != end;
}

/// Frames are known by session and id.
bool FrameEnqueuer::is_of_another_rig(std::uint64_t session) noexcept {
  for (std::uint32_t rig = 0; rig < queues_.sessions.size(); ++rig)
    if (rig != rig_ && queues_.sessions[rig] == session) return true;
  queues_.sessions[rig_] = session;
  return false;
}

void FrameEnqueuer::reject(wire::WireStatus status, const ReceivedFrame& frame) noexcept {
  const wire::FrameHeader& header = frame.decoder.header();
  counters().count(status);
  if (header.identified || unidentified_limit_.allows(RateLimit::Clock::now())) {
    push_rejection(status, header, frame.receive_ns);
  } else {
    counters().count_unannounced();
  }
}

void FrameEnqueuer::push_rejection(wire::WireStatus status, const wire::FrameHeader& header,
                                   std::int64_t receive_ns) noexcept {
  wire::WireResult* rejection = queues_.rejections.claim();
  if (rejection == nullptr) return counters().count_unannounced();
  *rejection = {};
  rejection->session = header.session;
  rejection->frame_id = header.id;
  rejection->stamp_ns = header.stamp_ns;
  rejection->points.received = header.points;
  rejection->status = status;
  rejection->receive_ns = receive_ns;
  queues_.rejections.publish();
}

}  // namespace lbea::tool
