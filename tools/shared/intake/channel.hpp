// Bounded queues between threads. Nothing blocks or allocates after construction, except the calls that wait.
#pragma once

#include <algorithm>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <thread>
#include <vector>

namespace lbea::tool {

/// Wakes one waiting thread; several channels to that thread may share it.
class Doorbell {
 public:
  void ring() {
    {
      const std::lock_guard lock(mutex_);
      ++rings_;
    }
    changed_.notify_one();
  }
  /// Returns after `timeout`, or as soon as ring() was called since the waiting thread's last wait_for().
  void wait_for(std::chrono::nanoseconds timeout) {
    std::unique_lock lock(mutex_);
    changed_.wait_for(lock, timeout, [&] { return rings_ != seen_; });
    seen_ = rings_;
  }

 private:
  std::mutex mutex_;
  std::condition_variable changed_;
  std::uint64_t rings_ = 0, seen_ = 0;
};

/// A queue from exactly one producer thread to exactly one consumer thread. Slots keep their place and are filled and
/// read in place, so that the memory they hold (a cloud's points) is allocated once. Several threads may take the part
/// of one, each after the other has finished.
template <class T>
class Channel {
 public:
  /// `bell`: rung by publish() and close(); null: the consumer does not wait.
  explicit Channel(std::size_t slots, Doorbell* bell = nullptr) : slots_(slots), bell_(bell) {}
  Channel(const Channel&) = delete;
  Channel& operator=(const Channel&) = delete;

  [[nodiscard]] std::size_t capacity() const noexcept { return slots_.size(); }
  /// Slots published and not yet released; exact only for the two threads themselves.
  [[nodiscard]] std::size_t used() const noexcept {
    const std::size_t released = released_.load(std::memory_order_acquire);  // first: it never exceeds published_
    return std::min(published_.load(std::memory_order_acquire) - released, slots_.size());
  }
  /// All slots, to allocate what they hold before the threads start.
  [[nodiscard]] std::vector<T>& slots() noexcept { return slots_; }

  /// Producer: the next free slot to fill, or null when all are taken. The consumer sees it after publish().
  [[nodiscard]] T* claim() noexcept { return claim_at(published_.load(std::memory_order_relaxed)); }
  /// Producer: the same, waiting for a free slot.
  [[nodiscard]] T& wait_and_claim() noexcept { return wait_and_claim_at(published_.load(std::memory_order_relaxed)); }
  /// Producer: the slot that will be published after `before` others, waiting until it is free. Several threads may
  /// fill different slots at the same time; they are published one after the other.
  [[nodiscard]] T& wait_and_claim_at(std::size_t before) noexcept {
    constexpr std::chrono::microseconds poll_interval{100};
    T* slot = claim_at(before);
    for (; slot == nullptr; slot = claim_at(before)) std::this_thread::sleep_for(poll_interval);
    return *slot;
  }
  void publish() noexcept {
    published_.fetch_add(1, std::memory_order_release);
    ring();
  }
  /// Producer: whether there was a free slot for `value`.
  bool push(const T& value) noexcept {
    T* slot = claim();
    if (slot == nullptr) return false;
    *slot = value;
    publish();
    return true;
  }
  /// Producer: everything is published. Whoever reads closed() before it finds the queue empty has seen all slots.
  void close() noexcept {
    closed_ = true;
    ring();
  }
  [[nodiscard]] bool closed() const noexcept { return closed_; }

  /// Consumer: the slot that was published after `before` others, or null when it is none yet. It stays valid until it
  /// is released.
  [[nodiscard]] T* at(std::size_t before) noexcept {
    return before < published_.load(std::memory_order_acquire) ? &slots_[before % slots_.size()] : nullptr;
  }
  /// Consumer: the oldest published slot, or null when there is none. It stays valid until release().
  [[nodiscard]] T* front() noexcept { return at(released_.load(std::memory_order_relaxed)); }
  void release() noexcept { released_.fetch_add(1, std::memory_order_release); }

 private:
  [[nodiscard]] T* claim_at(std::size_t before) noexcept {
    if (before - released_.load(std::memory_order_acquire) >= slots_.size()) return nullptr;
    return &slots_[before % slots_.size()];
  }
  void ring() noexcept {
    if (bell_ != nullptr) bell_->ring();
  }

  static constexpr std::size_t cache_line = 64;  // the two threads write to different cache lines
  std::vector<T> slots_;
  Doorbell* bell_;  // may be null
  std::atomic<bool> closed_{false};
  alignas(cache_line) std::atomic<std::size_t> published_{0};
  alignas(cache_line) std::atomic<std::size_t> released_{0};
};

}  // namespace lbea::tool
