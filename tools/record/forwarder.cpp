#include "tools/record/forwarder.hpp"

#include <algorithm>

namespace lbea::tool {

void PendingControls::add(const SenderControl& control) {
  if (SenderControl* last = control.ends_stream ? nullptr : replaceable_by(control.control)) {
    *last = control;
    return;
  }
  if (queue_.size() == max_size) queue_.pop_front();
  queue_.push_back(control);
}

/// The session's last control message, unless it is the session's first or holds anything that `later` does not repeat.
SenderControl* PendingControls::replaceable_by(const wire::Control& later) {
  const auto is_of_session = [&](const SenderControl& pending) { return pending.control.session == later.session; };
  const auto last = std::find_if(queue_.rbegin(), queue_.rend(), is_of_session);
  if (last == queue_.rend() || std::find_if(last + 1, queue_.rend(), is_of_session) == queue_.rend()) return nullptr;
  const wire::Control& earlier = last->control;
  const bool is_contained = earlier.withheld == 0 && later.next_id - later.withheld >= earlier.next_id;
  return is_contained && !last->ends_stream ? &*last : nullptr;
}

void Forwarder::send_control(const SenderControl& control) {
  pending_.add(control);
  send_pending();
}

bool Forwarder::send(wire::Message frame) { return send_pending() && sink_.send(frame); }

bool Forwarder::send_pending() {
  for (; !pending_.empty(); pending_.pop()) {
    const auto& [control, ends_stream] = pending_.front();
    if (!sink_.tell(ends_stream ? encoder_.end_of_stream(control.session, control.next_id) : encoder_.control(control)))
      return false;
  }
  return true;
}

Forwarder::LeftOver Forwarder::finish(std::chrono::milliseconds timeout) {
  using Clock = std::chrono::steady_clock;
  const auto left = [deadline = Clock::now() + timeout] {
    return std::chrono::duration_cast<std::chrono::milliseconds>(
        std::max(deadline - Clock::now(), Clock::duration::zero()));
  };
  while (!send_pending() && left().count() > 0) static_cast<void>(sink_.wait_ready(left()));
  const std::uint64_t frames = sink_.flush(left());
  return {pending_.size(), frames};
}

void DeliveredFrames::add(const wire::WireState& state) {
  if (std::exchange(start_ns_, state.start_ns) != state.start_ns)
    for (const wire::WireSender& sender : latest_)
      if (by_former_.size() < most_former) by_former_[sender.session] += sender.received;
  latest_ = state.senders;
}

std::uint64_t DeliveredFrames::missing_of(const std::vector<wire::WireSender>& senders) const {
  std::uint64_t missing = 0;
  for (const wire::WireSender& sender : senders) {
    const auto now = std::ranges::find(latest_, sender.session, &wire::WireSender::session);
    const auto before = by_former_.find(sender.session);
    if (now == latest_.end() && latest_.size() >= IdTracker::max_sessions) continue;  // forgotten
    const std::uint64_t received =
        (now == latest_.end() ? 0 : now->received) + (before == by_former_.end() ? 0 : before->second);
    missing += sender.received - std::min(sender.received, received);
  }
  return missing;
}

}  // namespace lbea::tool
