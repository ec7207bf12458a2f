#include "adapters/mcap/record_ring.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <system_error>

#include <sys/mman.h>
#include <unistd.h>

namespace lbea::mcap {
namespace {

[[noreturn]] void fail(std::size_t bytes, int error) {
  throw Error(Status::bad_config, "a recording buffer of " + std::to_string(bytes >> 20) +
                                      " MB: " + std::generic_category().message(error) + "; ask for less");
}

std::size_t whole_pages(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  if (bytes > std::numeric_limits<std::size_t>::max() / 4) fail(bytes, ENOMEM);
  return std::max<std::size_t>(1, (bytes + page - 1) / page) * page;
}

/// The same memory twice in a row; null and errno on failure.
std::byte* map_twice(int descriptor, std::size_t bytes) {
  void* both = ::mmap(nullptr, 2 * bytes, PROT_NONE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
  if (both == MAP_FAILED) return nullptr;
  auto* const first = static_cast<std::byte*>(both);
  for (std::byte* copy : {first, first + bytes}) {
    if (::mmap(copy, bytes, PROT_READ | PROT_WRITE, MAP_SHARED | MAP_FIXED | MAP_POPULATE, descriptor, 0) != MAP_FAILED)
      continue;
    const int error = errno;
    ::munmap(both, 2 * bytes);
    errno = error;
    return nullptr;
  }
  return first;
}

}  // namespace

RecordRing::RecordRing(std::size_t bytes) : capacity_(whole_pages(bytes)) {
  const int descriptor = ::memfd_create("lbea-recording", MFD_CLOEXEC);
  if (descriptor < 0) fail(capacity_, errno);
  const bool sized = ::ftruncate(descriptor, static_cast<off_t>(capacity_)) == 0;
  if (sized) memory_ = map_twice(descriptor, capacity_);
  const int error = errno;
  ::close(descriptor);
  if (memory_ == nullptr) fail(capacity_, error);
}

RecordRing::~RecordRing() { ::munmap(memory_, 2 * capacity_); }

bool RecordRing::put(Bytes head, Bytes body) noexcept {
  const std::uint64_t written = written_.load(std::memory_order_relaxed);
  const auto used = static_cast<std::size_t>(written - released_.load(std::memory_order_acquire));
  const std::size_t room = capacity_ - used;
  if (head.size() > room || body.size() > room - head.size()) return false;
  std::byte* to = memory_ + written % capacity_;
  if (!head.empty()) std::memcpy(to, head.data(), head.size());
  if (!body.empty()) std::memcpy(to + head.size(), body.data(), body.size());
  written_.store(written + head.size() + body.size(), std::memory_order_release);
  return true;
}

Bytes RecordRing::readable() const noexcept {
  const std::uint64_t released = released_.load(std::memory_order_relaxed);
  const std::uint64_t written = written_.load(std::memory_order_acquire);
  return {memory_ + released % capacity_, static_cast<std::size_t>(written - released)};
}

}  // namespace lbea::mcap
