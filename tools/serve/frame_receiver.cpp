#include "tools/serve/frame_receiver.hpp"

#include "tools/serve/short_ns.hpp"
#include "tools/shared/cli/wall_clock.hpp"

#include <utility>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr auto receive_timeout = 50ms;
constexpr auto longest_drain = 500ms;  // taking in after stop() what had arrived, from a sender that goes on
constexpr auto drained = 100ms;        // nothing for so long: that was all. Less, and a busy machine leaves frames of a
                                       // sender that has gone in the socket

}  // namespace

FrameReceiver::FrameReceiver(const PipelineConfig& config, wire::FrameSource source, Handover& handover)
    : source_(std::move(source)),
      decoder_(config.limits),
      announcer_(config.stray_results_per_second, handover),
      accounts_(config.sender_patience, announcer_, handover),
      observer_(config.observer),
      handover_(handover) {}

void FrameReceiver::run() noexcept {
  while (!stopping_) {
    ++rounds_;
    if (const auto message = source_.receive(receive_timeout)) take(*message, false);
    accounts_.show_when_due();
  }
  drain();
  const wire::PeerCounts peers = source_.peers();
  accounts_.show_at_end(peers.admitted > 0 && peers.peers == 0);
  handover_.receiver_done = true;
  handover_.frame_bell.ring();
}

void FrameReceiver::drain() noexcept {
  for (const auto stopped = Clock::now(); Clock::now() - stopped < longest_drain;) {
    const auto message = source_.receive(drained);
    if (!message) return;
    take(*message, true);
  }
}

void FrameReceiver::take(wire::Message message, bool patient) noexcept {
  const std::int64_t receive_ns = mcap::wall_clock_ns();
  if (wire::message_kind(message) == wire::MessageKind::control && take_control(message, receive_ns)) return;
  take_frame(message, patient, receive_ns);
  // After the matcher has its copy, so that it need not wait for this one.
  if (observer_ != nullptr) observer_->frame(message, decoder_.header(), receive_ns);
}

bool FrameReceiver::take_control(wire::Message message, std::int64_t receive_ns) noexcept {
  wire::Control control;
  if (wire::decode_control(message, control) != wire::WireStatus::ok) return false;
  if (!accounts_.report(control, receive_ns)) return false;
  if (control.kind == wire::ControlKind::heartbeat) return true;
  handover_.state_wanted = true;
  handover_.result_bell.ring();
  return true;
}

void FrameReceiver::take_frame(wire::Message message, bool patient, std::int64_t receive_ns) noexcept {
  const auto begin = Clock::now();
  wire::WireStatus status = decoder_.open(message);
  const wire::FrameHeader& header = decoder_.header();
  if (header.identified) status = note_id(status, receive_ns);
  const bool is_end = status == wire::WireStatus::end_of_stream;
  if (!is_end) handover_.counters.count_received();
  if (status != wire::WireStatus::ok && !is_end) {
    announcer_.refuse(status, header, receive_ns);
  } else if (FrameSlot* slot = claim_slot(patient || is_end)) {
    accept(*slot, begin, receive_ns);
  } else {
    announcer_.refuse(wire::WireStatus::queue_full, header, receive_ns);
  }
}

wire::WireStatus FrameReceiver::note_id(wire::WireStatus status, std::int64_t receive_ns) noexcept {
  const wire::FrameHeader& header = decoder_.header();
  if (status == wire::WireStatus::end_of_stream) {
    const bool is_possible = accounts_.report({header.session, wire::ControlKind::goodbye, header.id, 0}, receive_ns);
    return is_possible ? status : wire::WireStatus::damaged;
  }
  const IdTracker::Arrival arrival = accounts_.observe(header.session, header.id, receive_ns);
  if (arrival == IdTracker::Arrival::impossible) return wire::WireStatus::damaged;
  return arrival == IdTracker::Arrival::duplicate && status == wire::WireStatus::ok ? wire::WireStatus::duplicate
                                                                                    : status;
}

FrameSlot* FrameReceiver::claim_slot(bool patient) noexcept {
  return patient ? &wait_for_slot(handover_.frames) : handover_.frames.claim();
}

void FrameReceiver::accept(FrameSlot& slot, Clock::time_point begin, std::int64_t receive_ns) noexcept {
  slot.header = decoder_.header();
  slot.header.frame_id = {};
  slot.header.cloud = {};
  decoder_.read_points(slot.points);
  slot.receive_ns = receive_ns;
  slot.queued = Clock::now();
  slot.decode_ns = since_ns(begin);
  handover_.frames.publish();
  handover_.frame_bell.ring();
}

}  // namespace lbea::tool
