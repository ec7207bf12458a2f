#include "tools/record/frame_tap.hpp"

#include "tools/shared/cli/wall_clock.hpp"

#include <algorithm>
#include <chrono>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr auto receive_timeout = 50ms;
constexpr auto longest_drain = 500ms;  // taking in after stop() what had arrived, from a sender that goes on
constexpr auto drained = 100ms;        // nothing for so long: that was all
constexpr auto last_results = 300ms;   // after the last frame, its result may be on its way
constexpr auto farewell = 2000ms;
constexpr auto senders_interval = 100ms;

/// What a message says beside frames, if it does; the decoder has opened it.
std::optional<SenderWord> word_in(wire::Message message, wire::WireStatus status, const wire::FrameHeader& header) {
  if (status == wire::WireStatus::end_of_stream)
    return SenderWord{{header.session, wire::ControlKind::goodbye, header.id, 0}, true};
  wire::Control control;
  if (wire::message_kind(message) != wire::MessageKind::control ||
      wire::decode_control(message, control) != wire::WireStatus::ok)
    return std::nullopt;
  return SenderWord{control};
}

}  // namespace

FrameTap::FrameTap(wire::FrameSource frames, std::optional<wire::FrameSink> forward,
                   std::optional<wire::ResultSource> results, RunRecorder& recorder, wire::WireLimits limits)
    : frames_(std::move(frames)), results_(std::move(results)), recorder_(recorder), decoder_(limits) {
  if (forward) forward_.emplace(std::move(*forward));
  try {
    frames_thread_ = std::thread(&FrameTap::take_frames, this);
    if (results_) results_thread_ = std::thread(&FrameTap::take_results, this);
  } catch (...) {  // no destructor runs for a half-built object
    stop();
    throw;
  }
}

FrameTap::~FrameTap() { stop(); }

void FrameTap::stop() {
  stopping_ = true;
  for (std::thread* thread : {&frames_thread_, &results_thread_})
    if (thread->joinable()) thread->join();
}

TapTally FrameTap::tally() const noexcept {
  return {received_, damaged_,  too_many_points_, forwarded_,    refused_,
          missed_,   withheld_, silent_,          lost_results_, untold_};
}

void FrameTap::take_frames() noexcept {
  while (!stopping_) take_next(receive_timeout);
  for (const auto stopped = Clock::now(); Clock::now() - stopped < longest_drain && take_next(drained);) {}
  const wire::PeerCounts peers = frames_.peers();
  show_senders(Clock::now(), peers.admitted > 0 && peers.peers == 0
                                 ? Clock::duration(-1)
                                 : IdTracker::default_sender_timeout);  // no patience with who is gone
  if (forward_) untold_ = forward_->finish(farewell);
}

bool FrameTap::take_next(std::chrono::milliseconds timeout) noexcept {
  const auto message = frames_.receive(timeout);
  if (message) take(*message);
  if (!message && forward_) forward_->offer();
  if (const auto now = Clock::now(); now >= next_show_) show_senders(now, IdTracker::default_sender_timeout);
  return message.has_value();
}

void FrameTap::take(wire::Message message) noexcept {
  const std::int64_t receive_ns = mcap::wall_clock_ns();
  const wire::WireStatus status = decoder_.open(message);
  const auto word = word_in(message, status, decoder_.header());
  if (!word || !hear(*word)) take_frame(message, word ? wire::WireStatus::damaged : status, receive_ns);
  missed_ = ids_.missed() + ids_.withheld();
  withheld_ = ids_.withheld();
}

/// Recorded whatever its condition, as far as there is a cloud.
void FrameTap::take_frame(wire::Message message, wire::WireStatus status, std::int64_t receive_ns) noexcept {
  const wire::FrameHeader& header = decoder_.header();
  ++received_;
  // First on its way to the matcher, then into the recording.
  const bool is_refused = forward_ && !forward_->send(message);
  recorder_.frame(message, header, receive_ns);
  if (header.cloud.empty()) ++damaged_;
  if (status == wire::WireStatus::too_many_points) ++too_many_points_;
  if (header.identified && !header.end_of_stream) {
    const auto [arrival, gap] = ids_.observe(header.session, header.id, Clock::now());
    note(TapEvent::Kind::received, wire::WireStatus::missed, header.session, gap);
    if (arrival == IdTracker::Arrival::impossible) status = wire::WireStatus::damaged;
    if (arrival == IdTracker::Arrival::duplicate && status == wire::WireStatus::ok)
      status = wire::WireStatus::duplicate;
  }
  const IdRange id{header.id, 1};
  if (status != wire::WireStatus::ok || ids_.sessions() != known_sessions_)
    note(TapEvent::Kind::received, status, header.session, id);
  known_sessions_ = ids_.sessions();
  if (!forward_) return;
  ++(is_refused ? refused_ : forwarded_);
  if (is_refused) note(TapEvent::Kind::refused, status, header.session, id);
}

/// False when it cannot be true.
bool FrameTap::hear(const SenderWord& word) noexcept {
  const wire::Control& control = word.control;
  const IdTracker::Report report = ids_.report(control, Clock::now());
  if (!report.is_possible) return false;
  note(TapEvent::Kind::received, wire::WireStatus::missed, control.session, report.gap);
  note(TapEvent::Kind::received, wire::WireStatus::withheld, control.session, report.withheld);
  if (word.ends_stream)
    note(TapEvent::Kind::received, wire::WireStatus::end_of_stream, control.session, {control.next_id, 1});
  if (forward_) forward_->tell(word);
  return true;
}

void FrameTap::note(TapEvent::Kind kind, wire::WireStatus status, std::uint64_t session, IdRange ids) noexcept {
  if (ids.count == 0) return;
  TapEvent* event = events_.claim();
  if (event == nullptr) return;
  *event = {kind, status, session, ids};
  events_.publish();
}

void FrameTap::show_senders(Clock::time_point now, Clock::duration patience) noexcept {
  next_show_ = now + senders_interval;
  auto senders = ids_.senders(now, patience);
  silent_ = static_cast<std::uint64_t>(
      std::ranges::count(senders, wire::SenderCondition::silent, &wire::WireSender::condition));
  senders_.store(std::move(senders));
}

void FrameTap::take_results() noexcept {
  wire::WireResult result;
  wire::WireState state;
  while (true) {
    const bool last_look = stopping_;
    const auto message = results_->receive(last_look ? last_results : std::chrono::milliseconds(receive_timeout));
    if (!message && last_look) break;
    if (!message) continue;
    if (wire::decode_result(*message, result) == wire::WireStatus::ok) {
      note_sequence(result.sequence);
      recorder_.result(*message, result);
    } else if (wire::decode_state(*message, state) == wire::WireStatus::ok) {
      note_sequence(state.sequence);
      recorder_.state(*message, state);
    }
  }
}

void FrameTap::note_sequence(std::uint64_t sequence) noexcept {
  if (next_sequence_ != 0 && sequence > next_sequence_) lost_results_ += sequence - next_sequence_;
  next_sequence_ = sequence + 1;
}

}  // namespace lbea::tool
