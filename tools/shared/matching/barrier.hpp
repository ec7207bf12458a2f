// Where threads wait for each other: std::barrier, where it can be trusted.
#pragma once

#ifdef _WIN32
#include <condition_variable>
#include <cstddef>
#include <mutex>
#else
#include <barrier>
#endif

namespace lbea::tool {

#ifdef _WIN32
/// Without a futex, std::atomic::wait() of GCC 12, with which std::barrier waits, compares the value before it takes
/// the mutex, so that it can miss the notification.
class Barrier {
 public:
  explicit Barrier(std::ptrdiff_t threads) : threads_(threads) {}
  void arrive_and_wait() {
    std::unique_lock lock(mutex_);
    const std::size_t phase = phase_;
    if (++arrived_ >= threads_) return complete();
    changed_.wait(lock, [&] { return phase_ != phase; });
  }
  void arrive_and_drop() {
    const std::lock_guard lock(mutex_);
    if (arrived_ >= --threads_) complete();
  }

 private:
  void complete() {
    arrived_ = 0;
    ++phase_;
    changed_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable changed_;
  std::ptrdiff_t threads_, arrived_ = 0;
  std::size_t phase_ = 0;
};
#else
using Barrier = std::barrier<>;
#endif

}  // namespace lbea::tool
