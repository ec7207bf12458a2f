#include "tools/shared/recording/recorder.hpp"

#include <cerrno>
#include <new>

namespace lbea::tool {
namespace {

using namespace std::chrono_literals;
using wire::RecordingPhase;

constexpr auto poll_interval = 2ms;  // of the rings; a crash may lose what is younger than this plus longest_wait
constexpr std::chrono::nanoseconds grace = 200ms;  // messages of the window may arrive this late
constexpr std::int64_t no_trigger = std::numeric_limits<std::int64_t>::min();

RecorderConfig with_reserve(RecorderConfig config, const mcap::Sink& sink) {
  config.disk_reserve_bytes = std::min(config.disk_reserve_bytes, sink.free_bytes() / 8);
  return config;
}

}  // namespace

Recorder::Recorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RecordingStart& start)
    : sink_(std::move(sink)),
      config_(with_reserve(config, *sink_)),
      definitions_(start, config.definitions_interval),
      frames_(config.frame_ring_bytes, definitions_),
      notes_(config.note_ring_bytes, definitions_),
      file_(*sink_, config.compression, start, definitions_, disk_),
      trigger_ns_(no_trigger),
      phase_(config.window ? RecordingPhase::armed : RecordingPhase::recording),
      syncer_(*sink_, config.sync_interval, disk_),
      thread_(&Recorder::run, this) {
  sink_->keep(true);
}

Recorder::~Recorder() {
  const RecorderStatus before = status();
  abandoned_ = thread_.joinable() && before.frames.recorded + before.frames.lost() == 0 && before.ring_used == 0;
  finish();
}

void Recorder::trigger(std::int64_t log_time_ns) noexcept {
  std::int64_t expected = no_trigger;
  trigger_ns_.compare_exchange_strong(expected, log_time_ns);
}

RecorderStatus Recorder::status() const noexcept {
  return {phase_,         frames_.counts(),   notes_.counts(),        disk_.bytes,        frames_.used(),
          frames_.peak(), frames_.capacity(), disk_.longest_write_ns, disk_.failed_syncs, disk_.last_error,
          window()};
}

RecorderStatus Recorder::finish() noexcept {
  stopping_ = true;
  if (thread_.joinable()) thread_.join();
  return status();
}

void Recorder::run() noexcept {
  while (!stopping_) {
    try_tick(false);
    std::this_thread::sleep_for(poll_interval);
  }
  while (!try_tick(true)) std::this_thread::sleep_for(poll_interval);
  if (phase_ == RecordingPhase::armed || phase_ == RecordingPhase::recording) end_file();
}

/// Running out of memory loses nothing: the messages are still in the rings.
bool Recorder::try_tick(bool last) noexcept {
  try {
    tick(last);
    return true;
  } catch (const std::bad_alloc&) { return false; }
}

void Recorder::tick(bool last) {
  const std::array queues{&notes_, &frames_};
  if (phase_ == RecordingPhase::armed && trigger_ns_ != no_trigger) {
    for (RecordQueue* queue : queues) queue->begin_window(window_begin_ns());
    phase_ = RecordingPhase::recording;
  }
  if (phase_ == RecordingPhase::recording) return record(last);
  const bool is_armed = phase_ == RecordingPhase::armed;
  const std::int64_t oldest_ns = is_armed ? wire::wall_clock_ns() - config_.window->before.count() : 0;
  for (RecordQueue* queue : queues) {
    if (is_armed && !last)
      queue->discard_before(oldest_ns);
    else  // messages after the end of the file are not wanted, or lost after a failure
      queue->discard_all(phase_ == RecordingPhase::failed);
  }
}

void Recorder::record(bool last) {
  const std::int64_t now_ns = wire::wall_clock_ns();  // before the rings are read: older messages are then in the file
  const auto now = Clock::now();
  const std::size_t waiting = waiting_bytes();
  if (waiting == 0 && !file_.report_is_due(now)) return void(waiting_since_ = {});
  if (waiting_since_ == Clock::time_point{}) waiting_since_ = now;
  if (last || waiting >= config_.chunk_bytes || now - waiting_since_ >= config_.longest_wait) {
    while (write_chunk() && (last || waiting_bytes() >= config_.chunk_bytes)) {}
    waiting_since_ = {};
  }
  if (config_.window && window_is_over(now_ns)) end_file();
}

/// Writes one chunk of what is waiting; false when nothing was.
bool Recorder::write_chunk() {
  const RecordQueue::Batch notes = notes_.front(config_.chunk_bytes, window_end_ns());
  const RecordQueue::Batch frames = frames_.front(config_.chunk_bytes, window_end_ns());
  const bool has_both = write_both(notes, frames);
  // Results and states are smaller: alone, they may find room on a full disk.
  const bool has_notes =
      has_both || (!notes.records.empty() && !frames.records.empty() && file_.write(notes.records, {}, status()));
  notes_.release(notes, has_notes);
  frames_.release(frames, has_both);
  return !notes.records.empty() || !frames.records.empty();
}

/// Writes both as one chunk; false when there is no room for the frames besides the reserve, or the sink failed.
bool Recorder::write_both(const RecordQueue::Batch& notes, const RecordQueue::Batch& frames) {
  if (!frames.records.empty() && sink_->free_bytes() < config_.disk_reserve_bytes + frames.records.size()) {
    disk_.last_error = ENOSPC;
    return false;
  }
  return file_.write(notes.records, frames.records, status());
}

std::int64_t Recorder::window_begin_ns() const noexcept { return trigger_ns_ - config_.window->before.count(); }

std::int64_t Recorder::window_end_ns() const noexcept {
  return config_.window ? trigger_ns_ + config_.window->after.count() : std::numeric_limits<std::int64_t>::max();
}

std::optional<RecorderStatus::Window> Recorder::window() const noexcept {
  if (!config_.window) return std::nullopt;
  if (trigger_ns_ == no_trigger) return RecorderStatus::Window{};
  return RecorderStatus::Window{true, window_begin_ns(), window_end_ns()};
}

bool Recorder::window_is_over(std::int64_t now_ns) const noexcept {
  if (frames_.is_past_window() && notes_.is_past_window()) return true;
  return now_ns > window_end_ns() + grace.count();
}

void Recorder::end_file() noexcept {
  syncer_.stop();
  if (abandoned_) {
    sink_->keep(false);
    phase_ = RecordingPhase::failed;
    return;
  }
  const bool ended = file_.write_last_report(status()) &&
                     (!stopping_ || !last_metadata_ || file_.write(*last_metadata_)) && file_.close(status());
  phase_ = ended ? RecordingPhase::finished : RecordingPhase::failed;
}

}  // namespace lbea::tool
