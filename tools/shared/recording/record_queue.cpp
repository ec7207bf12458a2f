#include "tools/shared/recording/record_queue.hpp"

namespace lbea::tool {
namespace {

bool is_message(const mcap::Record& record) { return record.opcode == mcap::Opcode::message; }

std::int64_t log_time_of(const mcap::Record& record) {
  const auto message = mcap::parse<mcap::Message>(record.content);
  return message ? static_cast<std::int64_t>(message->log_time) : 0;
}

}  // namespace

bool RecordRing::put(mcap::Bytes head, mcap::Bytes body) noexcept {
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  const auto used = static_cast<std::size_t>(written - released_.load(std::memory_order_acquire));
  const std::size_t room = capacity() - used;
  if (head.size() > room || body.size() > room - head.size()) return false;
  std::byte* to = memory_.data() + written % capacity();
  if (!head.empty()) std::memcpy(to, head.data(), head.size());
  if (!body.empty()) std::memcpy(to + head.size(), body.data(), body.size());
  written_.store(written + head.size() + body.size(), std::memory_order_release);
  return true;
}

mcap::Bytes RecordRing::readable() const noexcept {
  const std::uint64_t released = released_.load(std::memory_order_relaxed);
  const std::uint64_t written = written_.load(std::memory_order_acquire);
  return {memory_.data() + released % capacity(), static_cast<std::size_t>(written - released)};
}

bool RecordQueue::put(const mcap::Message& message) noexcept {
  const auto head = mcap::message_head(message, message.data.size());
  const bool accepted = ring_.put(head, message.data);
  if (!accepted) no_room_.fetch_add(1, std::memory_order_relaxed);
  const std::size_t used = ring_.used();
  if (used > peak_.load(std::memory_order_relaxed)) peak_.store(used, std::memory_order_relaxed);
  return accepted;
}

/// Discards records from the front; `count` counts messages.
template <class Unwanted>
void RecordQueue::discard_while(const Unwanted& is_unwanted, std::atomic<std::uint64_t>& count) {
  mcap::Bytes rest = ring_.readable();
  std::uint64_t offset = 0;
  while (const auto record = mcap::next_record(rest, offset)) {
    if (!is_unwanted(*record)) return;
    if (is_message(*record)) {
      ++count;
    } else {
      definitions_.add(*record);
    }
    ring_.release(static_cast<std::size_t>(mcap::record_prefix_bytes + record->length));
  }
}

void RecordQueue::discard_before(std::int64_t oldest_ns) {
  const std::size_t most = ring_.capacity() - ring_.capacity() / 8;
  while (!discarded_.empty() && discarded_.front() < oldest_ns) discarded_.pop_front();
  const auto is_unwanted = [&](const mcap::Record& record) {
    const std::int64_t time = is_message(record) ? log_time_of(record) : std::numeric_limits<std::int64_t>::min();
    if (time < oldest_ns) return true;
    if (ring_.used() <= most) return false;
    discarded_.push_back(time);
    return true;
  };
  discard_while(is_unwanted, outside_);
}

void RecordQueue::begin_window(std::int64_t begin_ns) {
  const auto missed = static_cast<std::uint64_t>(
      std::ranges::count_if(discarded_, [&](std::int64_t time) { return time >= begin_ns; }));
  no_room_ += missed;
  outside_ -= missed;
  discarded_.clear();  // counted once, also when what follows runs out of memory and all this is repeated
  discard_while([&](const mcap::Record& record) { return !is_message(record) || log_time_of(record) < begin_ns; },
                outside_);
}

RecordQueue::Batch RecordQueue::front(std::size_t most, std::int64_t end_ns) {
  const mcap::Bytes all = ring_.readable();
  mcap::Bytes rest = all;
  Batch batch;
  std::uint64_t offset = 0;
  while (const auto record = mcap::next_record(rest, offset)) {
    const bool message = is_message(*record);
    is_past_window_ = message && log_time_of(*record) > end_ns;
    const bool full = !batch.records.empty() && record->end() > most;
    if (full || is_past_window_) break;
    batch.messages += message ? 1 : 0;
    if (!message) definitions_.add(*record);
    batch.records = all.first(static_cast<std::size_t>(record->end()));
  }
  return batch;
}

void RecordQueue::release(const Batch& batch, bool written) noexcept {
  (written ? recorded_ : write_failed_) += batch.messages;
  ring_.release(batch.records.size());
}

void RecordQueue::discard_all(bool wanted) {
  discard_while([](const mcap::Record&) { return true; }, wanted ? write_failed_ : outside_);
}

}  // namespace lbea::tool
