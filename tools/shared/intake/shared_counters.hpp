// The pipeline's counters and what it knows of the senders, written by its threads and read by all of them.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "tools/shared/intake/id_tracker.hpp"

#include <algorithm>
#include <atomic>
#include <mutex>

namespace lbea::tool {

class SharedCounters {
 public:
  void count_received() noexcept { add(received_); }
  void count(wire::WireStatus status) noexcept { add(by_status_[static_cast<std::size_t>(status)]); }
  void count_unannounced(std::uint64_t frames = 1) noexcept { add(unannounced_, frames); }
  void store(const IdTracker& ids) noexcept {
    set(by_status_[static_cast<std::size_t>(wire::WireStatus::missed)], ids.missed());
    set(by_status_[static_cast<std::size_t>(wire::WireStatus::withheld)], ids.withheld());
    set(duplicates_, ids.duplicates());
    set(reordered_, ids.reordered());
    set(sessions_, ids.sessions());
  }
  void store_silent(std::uint64_t senders) noexcept { set(silent_, senders); }
  /// Fates may lag behind `received`, by what is on its way, and never run ahead of it.
  [[nodiscard]] wire::Counters load() const noexcept {
    wire::Counters counters;
    for (std::size_t i = 0; i < wire::wire_status_count; ++i)
      counters.by_status[i] = by_status_[i].load(std::memory_order_acquire);
    counters.received = received_.load(std::memory_order_acquire);
    counters.missed = counters.of(wire::WireStatus::missed);
    counters.duplicates = duplicates_.load(std::memory_order_relaxed);
    counters.reordered = reordered_.load(std::memory_order_relaxed);
    counters.sessions = sessions_.load(std::memory_order_relaxed);
    counters.silent = silent_.load(std::memory_order_relaxed);
    counters.unannounced = unannounced_.load(std::memory_order_relaxed);
    return counters;
  }

 private:
  using Count = std::atomic<std::uint64_t>;
  static void add(Count& count, std::uint64_t n = 1) noexcept { count.fetch_add(n, std::memory_order_release); }
  static void set(Count& count, std::uint64_t value) noexcept { count.store(value, std::memory_order_release); }
  Count received_{0}, duplicates_{0}, reordered_{0}, sessions_{0}, silent_{0}, unannounced_{0};
  std::array<Count, wire::wire_status_count> by_status_{};
};

/// The receiver's view of its senders, for those who publish it.
class SharedSenders {
 public:
  void store(std::vector<wire::WireSender> senders) {
    const std::lock_guard lock(mutex_);
    senders_.swap(senders);
  }
  [[nodiscard]] std::vector<wire::WireSender> load() const {
    const std::lock_guard lock(mutex_);
    return senders_;
  }

 private:
  mutable std::mutex mutex_;
  std::vector<wire::WireSender> senders_;
};

}  // namespace lbea::tool
