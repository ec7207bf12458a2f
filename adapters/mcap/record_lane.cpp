#include "adapters/mcap/record_lane.hpp"

#include <algorithm>
#include <limits>

namespace lbea::mcap {
namespace {

bool is_message(const mcap::Record& record) { return record.opcode == mcap::Opcode::message; }

std::int64_t log_time_of(const mcap::Record& record) {
  const auto message = mcap::parse<mcap::Message>(record.content);
  return message ? static_cast<std::int64_t>(message->log_time) : 0;
}

}  // namespace

bool RecordLane::put(const mcap::Message& message) noexcept {
  const auto head = mcap::message_head(message, message.data.size());
  const bool taken = ring_.put(head, message.data);
  if (!taken) no_room_.fetch_add(1, std::memory_order_relaxed);
  const std::size_t used = ring_.used();
  if (used > peak_.load(std::memory_order_relaxed)) peak_.store(used, std::memory_order_relaxed);
  return taken;
}

/// Drops records from the front; `count` is of messages.
template <class Unwanted>
void RecordLane::drop_while(const Unwanted& is_unwanted, std::atomic<std::uint64_t>& count) {
  mcap::Bytes rest = ring_.readable();
  std::uint64_t offset = 0;
  while (const auto record = mcap::next_record(rest, offset)) {
    if (!is_unwanted(*record)) return;
    if (is_message(*record)) {
      ++count;
    } else {
      definitions_.take(*record);
    }
    ring_.release(static_cast<std::size_t>(mcap::record_prefix_bytes + record->length));
  }
}

void RecordLane::forget_before(std::int64_t oldest_ns) {
  const std::size_t most = ring_.capacity() - ring_.capacity() / 8;
  while (!pushed_out_.empty() && pushed_out_.front() < oldest_ns) pushed_out_.pop_front();
  const auto is_unwanted = [&](const mcap::Record& record) {
    const std::int64_t time = is_message(record) ? log_time_of(record) : std::numeric_limits<std::int64_t>::min();
    if (time < oldest_ns) return true;
    if (ring_.used() <= most) return false;
    pushed_out_.push_back(time);
    return true;
  };
  drop_while(is_unwanted, outside_);
}

void RecordLane::begin_at(std::int64_t begin_ns) {
  const auto missed = static_cast<std::uint64_t>(
      std::ranges::count_if(pushed_out_, [&](std::int64_t time) { return time >= begin_ns; }));
  no_room_ += missed;
  outside_ -= missed;
  pushed_out_.clear();  // counted once, also when the rest has no memory yet and all this is tried again
  drop_while([&](const mcap::Record& record) { return !is_message(record) || log_time_of(record) < begin_ns; },
             outside_);
}

RecordLane::Cut RecordLane::cut(std::size_t most, std::int64_t end_ns) {
  const mcap::Bytes all = ring_.readable();
  mcap::Bytes rest = all;
  Cut cut;
  std::uint64_t offset = 0;
  while (const auto record = mcap::next_record(rest, offset)) {
    const bool message = is_message(*record);
    is_past_window_ = message && log_time_of(*record) > end_ns;
    const bool full = !cut.records.empty() && record->end() > most;
    if (full || is_past_window_) break;
    cut.messages += message ? 1 : 0;
    if (!message) definitions_.take(*record);
    cut.records = all.first(static_cast<std::size_t>(record->end()));
  }
  return cut;
}

void RecordLane::release(const Cut& cut, bool written) noexcept {
  (written ? recorded_ : write_failed_) += cut.messages;
  ring_.release(cut.records.size());
}

void RecordLane::drop_all(bool wanted) {
  drop_while([](const mcap::Record&) { return true; }, wanted ? write_failed_ : outside_);
}

}  // namespace lbea::mcap
