#include "adapters/recording/recorder.hpp"

#include "adapters/recording/recorder_account.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <new>
#include <system_error>

namespace lbea {

namespace {

using namespace std::chrono_literals;

constexpr auto poll_interval = 2ms;      // of the rings; with longest_wait the age of what a crash may lose
constexpr auto account_interval = 100ms;  // between two accounts of losses in the file
constexpr auto grace = 200ms;            // how long what belongs into the window may be on its way
constexpr std::int64_t no_trigger = std::numeric_limits<std::int64_t>::min();

constexpr std::array<std::string_view, 4> state_names{"armed", "recording", "finished", "failed"};

std::int64_t wall_clock_ns() noexcept {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

template <class Number>
void raise(std::atomic<Number>& peak, Number value) noexcept {
  if (value > peak.load(std::memory_order_relaxed)) peak.store(value, std::memory_order_relaxed);
}

bool is_message(const mcap::Record& record) { return record.opcode == mcap::Opcode::message; }

std::int64_t log_time_of(const mcap::Record& record) {
  const auto message = mcap::parse<mcap::Message>(record.content);
  return message ? static_cast<std::int64_t>(message->log_time) : 0;
}

}  // namespace

std::string_view to_string(RecorderState state) noexcept { return state_names[static_cast<std::size_t>(state)]; }

Recorder::Recorder(std::unique_ptr<mcap::Sink> sink, const RecorderConfig& config, const RecordingStart& start)
    : sink_(std::move(sink)),
      config_(config),
      writer_(*sink_, config.compression),
      frames_(config.frame_ring_bytes),
      notes_(config.note_ring_bytes),
      status_channel_(start.status_channel),
      trigger_ns_(no_trigger),
      state_(config.window ? RecorderState::armed : RecorderState::recording) {
  write_start(start);
  start_threads();
  sink_->keep(true);
}

/// The writing thread last: it alone ends the file.
void Recorder::start_threads() {
  if (config_.sync_interval > 0ms) sync_thread_ = std::thread(&Recorder::run_syncs, this);
  try {
    writer_thread_ = std::thread(&Recorder::run, this);
  } catch (...) {  // no destructor runs for a half-built object
    writing_done_ = true;
    if (sync_thread_.joinable()) sync_thread_.join();
    throw;
  }
}

Recorder::~Recorder() {
  const RecorderStatus before = status();
  abandoned_ = writer_thread_.joinable() && before.frames.recorded + before.frames.lost() == 0 && before.ring_used == 0;
  finish();
}

void Recorder::write_start(const RecordingStart& start) {
  int error = writer_.begin(start.header);
  for (const mcap::Metadata& metadata : start.metadata)
    if (error == 0) error = writer_.metadata(metadata);
  if (error != 0)
    throw Error(Status::write_failed, "the recording cannot be begun: " + std::generic_category().message(error) +
                                          "; check the folder and the free space");
  for (const mcap::Schema& schema : start.schemas) definitions_.schemas.emplace(schema.id, schema);
  for (const mcap::Channel& channel : start.channels) definitions_.channels.emplace(channel.id, channel);
  bytes_ = writer_.size();
}

bool Recorder::put(Lane lane, const mcap::Message& message) noexcept {
  LaneState& to = lane == Lane::frames ? frames_ : notes_;
  const auto head = mcap::message_head(message, message.data.size());
  const bool taken = to.ring.put(head, message.data);
  if (!taken) to.no_room.fetch_add(1, std::memory_order_relaxed);
  if (lane == Lane::frames) raise(ring_peak_, to.ring.used());
  return taken;
}

bool Recorder::put_channel(Lane lane, mcap::Bytes record) noexcept {
  return (lane == Lane::frames ? frames_ : notes_).ring.put(record, {});
}

void Recorder::trigger(std::int64_t log_time_ns) noexcept {
  std::int64_t expected = no_trigger;
  trigger_ns_.compare_exchange_strong(expected, log_time_ns);
}

RecorderStatus Recorder::status() const noexcept {
  const auto lane = [](const LaneState& from) {
    return RecorderStatus::Lane{from.recorded.load(), from.no_room.load(), from.write_failed.load(), from.outside.load()};
  };
  return {state_,     lane(frames_), lane(notes_),           bytes_,
          frames_.ring.used(), ring_peak_, frames_.ring.capacity(), longest_write_ns_, failed_syncs_, last_error_};
}

RecorderStatus Recorder::finish() noexcept {
  stopping_ = true;
  if (writer_thread_.joinable()) writer_thread_.join();
  return status();
}

void Recorder::run() noexcept {
  while (!stopping_) {
    try_tick(false);
    std::this_thread::sleep_for(poll_interval);
  }
  while (!try_tick(true)) std::this_thread::sleep_for(poll_interval);
  if (state_ == RecorderState::armed || state_ == RecorderState::recording) end_file();
}

/// Without memory nothing is lost yet: what waits is still in the rings.
bool Recorder::try_tick(bool last) noexcept {
  try {
    tick(last);
    return true;
  } catch (const std::bad_alloc&) {
    return false;
  }
}

void Recorder::run_syncs() noexcept {
  std::uint64_t synced = 0;
  auto due = Clock::now() + config_.sync_interval;
  while (!writing_done_) {
    std::this_thread::sleep_for(20ms);
    if (Clock::now() < due || bytes_ == synced) continue;
    synced = bytes_;
    if (const int error = sink_->sync(); error != 0) {
      last_error_ = error;
      ++failed_syncs_;
    }
    due = Clock::now() + config_.sync_interval;
  }
}

void Recorder::tick(bool last) {
  const std::int64_t now_ns = wall_clock_ns();
  if (state_ == RecorderState::armed && trigger_ns_ != no_trigger) begin_window();
  if (state_ == RecorderState::armed) {
    for (LaneState* lane : {&notes_, &frames_}) forget_old(*lane, now_ns);
    return;
  }
  if (state_ != RecorderState::recording) return end_window();
  const auto now = Clock::now();
  const std::size_t waiting = frames_.ring.used() + notes_.ring.used();
  if (waiting == 0 && Clock::now() < account_due_) return void(waiting_since_ = {});
  if (waiting_since_ == Clock::time_point{}) waiting_since_ = now;
  if (last || waiting >= config_.chunk_bytes || now - waiting_since_ >= config_.longest_wait) {
    while (write_chunk() && (last || frames_.ring.used() + notes_.ring.used() >= config_.chunk_bytes)) {
    }
    waiting_since_ = {};
  }
  if (config_.window && window_is_over(now_ns)) end_file();
}

/// While nothing has happened yet: keeps what is young enough, and room for what comes.
void Recorder::forget_old(LaneState& lane, std::int64_t now_ns) {
  const std::int64_t oldest = now_ns - config_.window->before.count();
  const std::size_t most = lane.ring.capacity() - lane.ring.capacity() / 8;
  while (!lane.pushed_out.empty() && lane.pushed_out.front() < oldest) lane.pushed_out.pop_front();
  mcap::Bytes rest = lane.ring.readable();
  std::uint64_t offset = 0;
  while (const auto record = mcap::next_record(rest, offset)) {
    const std::int64_t time = is_message(*record) ? log_time_of(*record) : std::numeric_limits<std::int64_t>::min();
    const bool crowded = lane.ring.used() > most;
    if (time >= oldest && !crowded) break;
    if (time >= oldest) lane.pushed_out.push_back(time);
    drop_front(lane, *record, lane.outside);
  }
}

void Recorder::begin_window() {
  const std::int64_t begin = trigger_ns_ - config_.window->before.count();
  for (LaneState* lane : {&notes_, &frames_}) {
    const auto missed = static_cast<std::uint64_t>(
        std::ranges::count_if(lane->pushed_out, [&](std::int64_t time) { return time >= begin; }));
    lane->no_room += missed;
    lane->outside -= missed;
    mcap::Bytes rest = lane->ring.readable();
    std::uint64_t offset = 0;
    while (const auto record = mcap::next_record(rest, offset)) {
      if (is_message(*record) && log_time_of(*record) >= begin) break;
      drop_front(*lane, *record, lane->outside);
    }
  }
  state_ = RecorderState::recording;
}

/// The file is written: what still comes is not asked for.
void Recorder::end_window() {
  for (LaneState* lane : {&notes_, &frames_}) {
    mcap::Bytes rest = lane->ring.readable();
    std::uint64_t offset = 0;
    while (const auto record = mcap::next_record(rest, offset))
      drop_front(*lane, *record, state_ == RecorderState::failed ? lane->write_failed : lane->outside);
  }
}

bool Recorder::window_is_over(std::int64_t now_ns) const {
  if (frames_.is_past_window && notes_.is_past_window) return true;
  return now_ns > trigger_ns_ + config_.window->after.count() + std::chrono::nanoseconds(grace).count();
}

void Recorder::drop_front(LaneState& lane, const mcap::Record& record, std::atomic<std::uint64_t>& count) {
  if (is_message(record)) {
    ++count;
  } else {
    note_definition(record);
  }
  lane.ring.release(static_cast<std::size_t>(mcap::record_prefix_bytes + record.length));
}

void Recorder::note_definition(const mcap::Record& record) {
  static_cast<void>(definitions_.take(record));
  definitions_changed_ = true;
}

Recorder::Cut Recorder::cut(LaneState& lane, std::size_t most) {
  const mcap::Bytes all = lane.ring.readable();
  mcap::Bytes rest = all;
  Cut cut;
  std::uint64_t offset = 0;
  const std::int64_t end = config_.window ? trigger_ns_ + config_.window->after.count() : std::numeric_limits<std::int64_t>::max();
  while (const auto record = mcap::next_record(rest, offset)) {
    const bool message = is_message(*record);
    lane.is_past_window = message && log_time_of(*record) > end;
    const bool full = !cut.records.empty() && record->end() > most;
    if (full || lane.is_past_window) break;
    cut.messages += message ? 1 : 0;
    if (!message) note_definition(*record);
    cut.records = all.first(static_cast<std::size_t>(record->end()));
  }
  return cut;
}

/// Writes what waits, up to a chunk; whether there was anything.
bool Recorder::write_chunk() {
  const Cut notes = cut(notes_, config_.chunk_bytes);
  const Cut frames = cut(frames_, config_.chunk_bytes);
  front_.clear();
  if (definitions_are_due(!notes.records.empty() || !frames.records.empty())) add_definitions();
  add_account();
  if (front_.empty() && notes.records.empty() && frames.records.empty()) return false;
  const std::array<mcap::Bytes, 3> pieces{front_, notes.records, frames.records};
  const auto begin = Clock::now();
  const int error = write(pieces);
  raise(longest_write_ns_, std::int64_t{(Clock::now() - begin) / 1ns});
  if (error != 0) last_error_ = error;
  definitions_changed_ = error != 0;
  (error == 0 ? notes_.recorded : notes_.write_failed) += notes.messages;
  (error == 0 ? frames_.recorded : frames_.write_failed) += frames.messages;
  notes_.ring.release(notes.records.size());
  frames_.ring.release(frames.records.size());
  bytes_ = writer_.size();
  return !notes.records.empty() || !frames.records.empty();
}

int Recorder::write(std::span<const mcap::Bytes> pieces) noexcept {
  try {
    return writer_.chunk(pieces);
  } catch (...) {
    return ENOMEM;
  }
}

/// At first, after a chunk was lost, and now and then, so that what is left of a damaged file can be read.
bool Recorder::definitions_are_due(bool has_messages) const {
  return definitions_changed_ || (has_messages && Clock::now() >= definitions_due_);
}

void Recorder::add_definitions() {
  definitions_due_ = Clock::now() + config_.definitions_interval;
  for (const auto& [id, schema] : definitions_.schemas) mcap::append(front_, schema);
  for (const auto& [id, channel] : definitions_.channels) mcap::append(front_, channel);
}

void Recorder::add_account() {
  const auto now = Clock::now();
  if (now < account_due_) return;
  account_due_ = now + account_interval;
  std::string account = account_json(status());
  if (account == account_) return;
  const auto time = static_cast<std::uint64_t>(wall_clock_ns());
  mcap::append(front_, mcap::Message{status_channel_, account_sequence_++, time, time, std::as_bytes(std::span(account))});
  account_ = std::move(account);
}

void Recorder::end_file() noexcept {
  writing_done_ = true;
  if (sync_thread_.joinable()) sync_thread_.join();
  if (abandoned_) {
    sink_->keep(false);
    state_ = RecorderState::failed;
    return;
  }
  int error = 0;
  try {
    account_due_ = {};
    front_.clear();
    if (definitions_changed_) add_definitions();  // lost with the last chunk, perhaps, and the account needs its own
    add_account();                                // the last one
    const mcap::Bytes piece = front_;
    if (!front_.empty()) error = writer_.chunk({&piece, 1});
    if (error == 0) error = writer_.metadata(closing_metadata(status()));
    if (error == 0) error = writer_.finish();
    if (error == 0) error = sink_->commit();
  } catch (...) {
    error = ENOMEM;
  }
  if (error != 0) last_error_ = error;
  bytes_ = writer_.size();
  state_ = error == 0 ? RecorderState::finished : RecorderState::failed;
}

}  // namespace lbea
