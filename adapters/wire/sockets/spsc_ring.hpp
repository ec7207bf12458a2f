// A bounded queue between exactly one producer thread and one consumer thread. Slots stay where they are and
// are filled and read in place, so what they hold (a cloud's memory) is allocated once. Never blocks, never
// allocates after construction. Waiting, where wanted, is done beside it: see Doorbell.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <vector>

namespace lbea::wire {

template <class T>
class SpscRing {
 public:
  explicit SpscRing(std::size_t slots) : slots_(slots) {}

  [[nodiscard]] std::size_t capacity() const noexcept { return slots_.size(); }
  /// Slots published and not yet released; exact only for the two threads themselves.
  [[nodiscard]] std::size_t used() const noexcept {
    const std::size_t released = released_.load(std::memory_order_acquire);  // first: it never overtakes the other
    return std::min(published_.load(std::memory_order_acquire) - released, slots_.size());
  }
  /// Before the threads start: every slot, to size what it holds.
  [[nodiscard]] std::vector<T>& slots() noexcept { return slots_; }

  /// Producer: the next free slot to fill, or null when all are taken. Nothing happens until publish().
  [[nodiscard]] T* claim() noexcept {
    const std::size_t next = published_.load(std::memory_order_relaxed);
    if (next - released_.load(std::memory_order_acquire) == slots_.size()) return nullptr;
    return &slots_[next % slots_.size()];
  }
  void publish() noexcept { published_.fetch_add(1, std::memory_order_release); }

  /// Consumer: the oldest published slot, or null when there is none. It stays the consumer's until
  /// release().
  [[nodiscard]] T* front() noexcept {
    const std::size_t next = released_.load(std::memory_order_relaxed);
    if (next == published_.load(std::memory_order_acquire)) return nullptr;
    return &slots_[next % slots_.size()];
  }
  void release() noexcept { released_.fetch_add(1, std::memory_order_release); }

 private:
  static constexpr std::size_t cache_line = 64;  // so that the two threads do not contend for one line
  std::vector<T> slots_;
  alignas(cache_line) std::atomic<std::size_t> published_{0};
  alignas(cache_line) std::atomic<std::size_t> released_{0};
};

/// Wakes a thread that waits for any of several rings.
class Doorbell {
 public:
  void ring() {
    {
      const std::lock_guard lock(mutex_);
      ++rings_;
    }
    bell_.notify_one();
  }
  /// Returns when ring() was called since the last wait_for() of this one waiting thread, or after `longest`.
  void wait_for(std::chrono::nanoseconds longest) {
    std::unique_lock lock(mutex_);
    bell_.wait_for(lock, longest, [&] { return rings_ != heard_; });
    heard_ = rings_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable bell_;
  std::uint64_t rings_ = 0, heard_ = 0;
};

}  // namespace lbea::wire
