#include "tools/record/frame_recorder.hpp"

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;

constexpr std::chrono::milliseconds result_timeout{50};
constexpr std::chrono::milliseconds last_result_timeout{300};  // after stop(), for the last frame's result
constexpr auto max_flush = 2000ms;

}  // namespace

FrameRecorder::FrameRecorder(wire::FrameSource frames, std::optional<wire::FrameSink> forward,
                             std::optional<wire::ResultSource> results, RunRecorder& recorder, wire::WireLimits limits)
    : results_(std::move(results)),
      recorder_(recorder),
      receiver_(std::move(frames), limits, IdTracker::default_sender_timeout, account_, *this) {
  if (forward) forward_.emplace(std::move(*forward));
  try {
    frames_thread_ = std::thread(&FrameRecorder::receive_frames, this);
    if (results_) results_thread_ = std::thread(&FrameRecorder::receive_results, this);
  } catch (...) {  // the destructor does not run
    stop();
    throw;
  }
}

FrameRecorder::~FrameRecorder() { stop(); }

void FrameRecorder::stop() {
  stopping_ = true;
  receiver_.stop();
  for (std::thread* thread : {&frames_thread_, &results_thread_})
    if (thread->joinable()) thread->join();
}

RecordTally FrameRecorder::tally() const noexcept {
  const wire::Counters counters = account_.counters.load();
  const std::uint64_t withheld = counters.of(wire::WireStatus::withheld);
  return {.received = counters.received,
          .damaged = damaged_,
          .too_many_points = too_many_points_,
          .forwarded = forwarded_,
          .refused = refused_,
          .missed = counters.missed + withheld,
          .withheld = withheld,
          .silent = counters.silent,
          .interleaved = counters.interleaved,
          .lost_results = lost_results_,
          .unforwarded_controls = unforwarded_controls_};
}

void FrameRecorder::receive_frames() noexcept {
  receiver_.run();
  if (forward_) unforwarded_controls_ = forward_->finish(max_flush);
}

void FrameRecorder::on_frame(const ReceivedFrame& frame) noexcept {
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
void FrameRecorder::record(const ReceivedFrame& frame) noexcept {
  const wire::FrameHeader& header = frame.decoder.header();
  recorder_.frame(frame.message, header, frame.receive_ns);
  if (header.cloud.empty()) ++damaged_;
  if (frame.message_status == wire::WireStatus::too_many_points) ++too_many_points_;
}

void FrameRecorder::on_absent(wire::WireStatus status, std::uint64_t session, IdRange ids, std::int64_t) noexcept {
  log_.note(status, session, ids);
}

void FrameRecorder::on_control(const wire::Control& control) noexcept {
  if (forward_) forward_->send_control({control});
}

void FrameRecorder::on_idle() noexcept {
  if (forward_) forward_->send_pending();
}

void FrameRecorder::write_log() {
  log_.write();
  log_.write(senders());
  log_.write(account_.counters.load());
  peers_.poll(PeerLog::Clock::now());
}

void FrameRecorder::receive_results() noexcept {
  wire::WireResult result;
  wire::WireState state;
  while (true) {
    const bool is_stopping = stopping_;
    const auto message = results_->receive(is_stopping ? last_result_timeout : result_timeout);
    if (!message && is_stopping) break;
    if (!message) continue;
    if (wire::decode_result(*message, result) == wire::WireStatus::ok) {
      count_sequence(result.sequence);
      recorder_.result(*message, result);
    } else if (wire::decode_state(*message, state) == wire::WireStatus::ok) {
      count_sequence(state.sequence);
      recorder_.state(*message, state);
    }
  }
}

void FrameRecorder::count_sequence(std::uint64_t sequence) noexcept {
  if (next_sequence_ != 0 && sequence > next_sequence_) lost_results_ += sequence - next_sequence_;
  next_sequence_ = sequence + 1;
}

}  // namespace lbea::tool
