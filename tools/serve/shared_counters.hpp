// The pipeline's counters, written by its threads and read by all of them.
#pragma once

#include "adapters/wire/id_tracker.hpp"
#include "adapters/wire/messages.hpp"

#include <atomic>

namespace lbea {

class SharedCounters {
 public:
  void count_received() noexcept { add(received_); }
  void count(WireStatus status) noexcept { add(by_status_[static_cast<std::size_t>(status)]); }
  void count_unannounced() noexcept { add(unannounced_); }
  void store(const IdTracker& ids) noexcept {
    missed_.store(ids.missed(), std::memory_order_relaxed);
    duplicates_.store(ids.duplicates(), std::memory_order_relaxed);
    sessions_.store(ids.sessions(), std::memory_order_relaxed);
  }
  /// Exact once the threads have ended; before that, fates may lag behind `received`, never run ahead of it.
  [[nodiscard]] Counters load() const noexcept {
    Counters counters;
    for (std::size_t i = 0; i < wire_status_count; ++i)
      counters.by_status[i] = by_status_[i].load(std::memory_order_acquire);
    counters.received = received_.load(std::memory_order_acquire);
    counters.missed = missed_.load(std::memory_order_relaxed);
    counters.duplicates = duplicates_.load(std::memory_order_relaxed);
    counters.sessions = sessions_.load(std::memory_order_relaxed);
    counters.unannounced = unannounced_.load(std::memory_order_relaxed);
    return counters;
  }

 private:
  using Count = std::atomic<std::uint64_t>;
  static void add(Count& count) noexcept { count.fetch_add(1, std::memory_order_release); }
  Count received_{0}, missed_{0}, duplicates_{0}, sessions_{0}, unannounced_{0};
  std::array<Count, wire_status_count> by_status_{};
};

}  // namespace lbea
