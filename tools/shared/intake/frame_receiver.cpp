#include "tools/shared/intake/frame_receiver.hpp"

#include <algorithm>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr auto receive_timeout = 50ms;
constexpr auto max_drain = 500ms;  // after stop(), for a sender that continues
// After stop(): no message for this long means that none is left. A shorter time leaves frames of a closed sender in
// the socket on a busy machine.
constexpr auto drain_timeout = 100ms;
constexpr auto publication_interval = 100ms;  // maximum age of the published sender state

}  // namespace

void SharedCounters::store(const IdTracker& ids) noexcept {
  set(by_status_[static_cast<std::size_t>(wire::WireStatus::missed)], ids.missed());
  set(by_status_[static_cast<std::size_t>(wire::WireStatus::withheld)], ids.withheld());
  set(duplicates_, ids.duplicates());
  set(reordered_, ids.reordered());
  set(sessions_, ids.sessions());
  set(interleaved_, ids.interleaved());
}

wire::Counters SharedCounters::load() const noexcept {
  wire::Counters counters;
  do {  // repeated if a frame is received meanwhile: frames that have a status would count as on the way
    counters.received = received_.load(std::memory_order_acquire);
    for (std::size_t i = 0; i < wire::wire_status_count; ++i)
      counters.by_status[i] = by_status_[i].load(std::memory_order_acquire);
  } while (counters.received != received_.load(std::memory_order_acquire));
  counters.missed = counters.of(wire::WireStatus::missed);
  counters.duplicates = duplicates_.load(std::memory_order_relaxed);
  counters.reordered = reordered_.load(std::memory_order_relaxed);
  counters.sessions = sessions_.load(std::memory_order_relaxed);
  counters.interleaved = interleaved_.load(std::memory_order_relaxed);
  counters.silent = silent_.load(std::memory_order_relaxed);
  counters.unannounced = unannounced_.load(std::memory_order_relaxed);
  return counters;
}

FrameReceiver::FrameReceiver(wire::FrameSource source, wire::WireLimits limits,
                             std::chrono::milliseconds sender_timeout, SharedAccount& account, IntakeSink& sink)
    : source_(std::move(source)), decoder_(limits), sender_timeout_(sender_timeout), account_(account), sink_(sink) {}

void FrameReceiver::run() noexcept {
  while (!stopping_) receive_next(receive_timeout, false);
  for (const auto stopped = Clock::now(); Clock::now() - stopped < max_drain && receive_next(drain_timeout, true);) {}
  publish_senders(Clock::now(), Clock::duration(-1));  // no goodbye can follow: who has said none is silent
}

void FrameReceiver::run_together(std::span<FrameReceiver* const> receivers) noexcept {
  std::vector<const wire::FrameSource*> sources;
  for (const FrameReceiver* receiver : receivers) sources.push_back(&receiver->source_);
  const auto is_stopping = [&] {
    return std::ranges::any_of(receivers, [](const FrameReceiver* receiver) { return receiver->stopping_.load(); });
  };
  while (!is_stopping()) receive_from_any(receivers, sources, receive_timeout, false);
  for (const auto stopped = Clock::now();
       Clock::now() - stopped < max_drain && receive_from_any(receivers, sources, drain_timeout, true);) {}
  for (FrameReceiver* receiver : receivers) receiver->publish_senders(Clock::now(), Clock::duration(-1));
}

/// At most one message of each. Whether one arrived within `timeout`.
bool FrameReceiver::receive_from_any(std::span<FrameReceiver* const> receivers,
                                     std::span<const wire::FrameSource* const> sources,
                                     std::chrono::milliseconds timeout, bool is_draining) noexcept {
  const auto receive_all = [&] {
    bool any = false;
    for (FrameReceiver* receiver : receivers) any = receiver->receive_next(0ms, is_draining) || any;
    return any;
  };
  if (receive_all()) return true;
  wire::wait_for_any(sources, timeout);
  return receive_all();
}

/// Whether a message arrived.
bool FrameReceiver::receive_next(std::chrono::milliseconds timeout, bool is_draining) noexcept {
  ++rounds_;
  const auto message = source_.receive(timeout);
  if (message) {
    receive(*message, is_draining);
  } else {
    sink_.on_idle();
  }
  if (const auto now = Clock::now(); now >= next_publication_) publish_senders(now, sender_timeout_);
  return message.has_value();
}

void FrameReceiver::receive(wire::Message message, bool is_draining) noexcept {
  const std::int64_t receive_ns = wire::wall_clock_ns();
  if (wire::message_kind(message) == wire::MessageKind::control && receive_control(message, receive_ns)) return;
  const auto begin = Clock::now();
  const wire::WireStatus message_status = decoder_.open(message);
  const wire::WireStatus status =
      decoder_.header().identified ? account_for(message_status, receive_ns) : message_status;
  if (status != wire::WireStatus::end_of_stream) account_.counters.count_received();
  sink_.on_frame({message, decoder_, message_status, status, receive_ns, begin, is_draining});
}

/// False when it is malformed or impossible; then it is rejected like a frame.
bool FrameReceiver::receive_control(wire::Message message, std::int64_t receive_ns) noexcept {
  wire::Control control;
  if (wire::decode_control(message, control) != wire::WireStatus::ok || !report(control, receive_ns)) return false;
  sink_.on_control(control);
  return true;
}

/// Counts the id of the opened frame and returns the frame's status.
wire::WireStatus FrameReceiver::account_for(wire::WireStatus status, std::int64_t receive_ns) noexcept {
  const wire::FrameHeader& header = decoder_.header();
  if (status == wire::WireStatus::end_of_stream) {
    const bool is_possible = report({header.session, wire::ControlKind::goodbye, header.id, 0}, receive_ns);
    return is_possible ? status : wire::WireStatus::damaged;
  }
  const auto now = Clock::now();
  const IdTracker::Observation seen = ids_.observe(header.session, header.id, now);
  status = status_after(seen.arrival, status);
  const bool is_of_other = status == wire::WireStatus::ok && !ids_.enter_test(header.session, now);
  account_.counters.store(ids_);
  pass_absent(wire::WireStatus::missed, header.session, seen.gap, receive_ns);
  return is_of_other ? wire::WireStatus::other_sender : status;
}

/// False when the control message is impossible.
bool FrameReceiver::report(const wire::Control& control, std::int64_t receive_ns) noexcept {
  const auto now = Clock::now();
  const IdTracker::Report report = ids_.report(control, now);
  if (!report.is_possible) return false;
  account_.counters.store(ids_);
  pass_absent(wire::WireStatus::missed, control.session, report.gap, receive_ns);
  pass_absent(wire::WireStatus::withheld, control.session, report.withheld, receive_ns);
  if (control.kind != wire::ControlKind::heartbeat) publish_senders(now, sender_timeout_);
  return true;
}

void FrameReceiver::pass_absent(wire::WireStatus status, std::uint64_t session, IdRange ids,
                                std::int64_t receive_ns) noexcept {
  if (ids.count > 0) sink_.on_absent(status, session, ids, receive_ns);
}

void FrameReceiver::publish_senders(Clock::time_point now, Clock::duration timeout) noexcept {
  next_publication_ = now + publication_interval;
  auto senders = ids_.senders(now, timeout);
  account_.counters.store_silent(static_cast<std::uint64_t>(
      std::ranges::count(senders, wire::SenderCondition::silent, &wire::WireSender::condition)));
  account_.senders.store(std::move(senders));
}

}  // namespace lbea::tool
