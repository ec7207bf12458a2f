#include "tools/record/frame_tap.hpp"

#include "tools/common/wall_clock.hpp"

#include <algorithm>
#include <chrono>

namespace lbea {

namespace {

using namespace std::chrono_literals;

constexpr auto receive_timeout = 50ms;
constexpr auto last_results = 300ms;  // after the last frame, its result may be on its way
constexpr auto farewell = 2000ms;

}  // namespace

FrameTap::FrameTap(FrameSource frames, std::optional<FrameSink> forward, std::optional<ResultSource> results, RunRecorder& recorder,
                   WireLimits limits)
    : frames_(std::move(frames)), forward_(std::move(forward)), results_(std::move(results)), recorder_(recorder), decoder_(limits) {
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

TapTally FrameTap::tally() const noexcept { return {received_, damaged_, forwarded_, refused_, missed_, silent_, lost_results_}; }

void FrameTap::take_frames() noexcept {
  while (true) {
    const bool last_look = stopping_;
    const auto message = frames_.receive(receive_timeout);
    if (message) take(*message);
    if (last_look && !message) break;
  }
  senders_ = ids_.senders(IdTracker::Clock::now(), IdTracker::usual_patience);
  silent_ = static_cast<std::uint64_t>(std::ranges::count(senders_, SenderCondition::silent, &WireSender::condition));
  if (forward_) static_cast<void>(forward_->flush(farewell));
}

void FrameTap::take(Message message) noexcept {
  const std::int64_t receive_ns = wall_clock_ns();
  if (take_words(message)) {
    if (forward_) forward_->tell(message, farewell);  // what is said about frames is worth waiting for
    return;
  }
  // First on its way to the matcher, then into the recording. A frame that finds no room is refused, as by a camera.
  if (forward_) ++(forward_->send(message) ? forwarded_ : refused_);
  const FrameHeader& header = decoder_.header();
  ++received_;
  if (header.identified) ids_.saw(header.session, header.id, IdTracker::Clock::now());
  missed_ = ids_.missed() + ids_.withheld();
  if (header.cloud.empty()) ++damaged_;
  recorder_.frame(message, header, receive_ns);
}

/// False for a frame, which then is opened, whatever its condition.
bool FrameTap::take_words(Message message) noexcept {
  Control control;
  if (message_kind(message) != MessageKind::control || decode_control(message, control) != WireStatus::ok) {
    if (decoder_.open(message) != WireStatus::end_of_stream) return false;
    control = {decoder_.header().session, ControlKind::goodbye, decoder_.header().id, 0};
  }
  ids_.told(control, IdTracker::Clock::now());
  missed_ = ids_.missed() + ids_.withheld();
  return true;
}

void FrameTap::take_results() noexcept {
  WireResult result;
  WireState state;
  while (true) {
    const bool last_look = stopping_;
    const auto message = results_->receive(last_look ? last_results : std::chrono::milliseconds(receive_timeout));
    if (!message && last_look) break;
    if (!message) continue;
    if (decode_result(*message, result) == WireStatus::ok) {
      note_sequence(result.sequence);
      recorder_.result(*message, result);
    } else if (decode_state(*message, state) == WireStatus::ok) {
      note_sequence(state.sequence);
      recorder_.state(*message, state);
    }
  }
}

void FrameTap::note_sequence(std::uint64_t sequence) noexcept {
  if (next_sequence_ != 0 && sequence > next_sequence_) lost_results_ += sequence - next_sequence_;
  next_sequence_ = sequence + 1;
}

}  // namespace lbea
