// A ring of MCAP records between one producing and one consuming thread. It is mapped twice, one copy behind the
// other, so that what lies in it is always one piece of memory: a chunk is written to the file straight from here.
#pragma once

#include "adapters/mcap/mcap_records.hpp"

#include <algorithm>
#include <atomic>

namespace lbea::mcap {

class RecordRing {
 public:
  /// At least `bytes`, rounded up to whole pages and touched once, so that no page is missing later.
  /// Throws Error{bad_config} when the system does not give that much.
  explicit RecordRing(std::size_t bytes);
  ~RecordRing();
  RecordRing(const RecordRing&) = delete;
  RecordRing& operator=(const RecordRing&) = delete;

  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  /// Bytes put and not yet given back; exact only for the two threads themselves.
  [[nodiscard]] std::size_t used() const noexcept {
    const std::uint64_t released = released_.load(std::memory_order_acquire);  // first: it never overtakes the other
    return std::min(static_cast<std::size_t>(written_.load(std::memory_order_acquire) - released), capacity_);
  }

  // producer
  /// Appends `head` and `body` as one; false when there is no room. Never blocks.
  bool put(Bytes head, Bytes body) noexcept;

  // consumer
  /// All that is there: whole puts, one behind the other.
  [[nodiscard]] Bytes readable() const noexcept;
  /// Gives back the first `bytes` of it.
  void release(std::size_t bytes) noexcept { released_.fetch_add(bytes, std::memory_order_release); }

 private:
  static constexpr std::size_t cache_line = 64;
  std::size_t capacity_;
  std::byte* memory_ = nullptr;
  alignas(cache_line) std::atomic<std::uint64_t> written_{0};
  alignas(cache_line) std::atomic<std::uint64_t> released_{0};
};

}  // namespace lbea::mcap
