#include "tools/shared/system/mirrored_memory.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <limits>
#include <string>
#include <system_error>

#include <sys/mman.h>
#include <unistd.h>

namespace lbea::tool {
namespace {

[[noreturn]] void fail(std::size_t bytes, int error) {
  throw Error(Status::bad_config, "a recording buffer of " + std::to_string(bytes >> 20) +
                                      " MB: " + std::generic_category().message(error) + "; request less");
}

std::size_t whole_pages(std::size_t bytes) {
  const auto page = static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
  if (bytes > std::numeric_limits<std::size_t>::max() / 4) fail(bytes, ENOMEM);
  return std::max<std::size_t>(1, (bytes + page - 1) / page) * page;
}

/// Null and errno on failure.
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

MirroredMemory::MirroredMemory(std::size_t bytes) : size_(whole_pages(bytes)) {
  const int descriptor = ::memfd_create("lbea-recording", MFD_CLOEXEC);
  if (descriptor < 0) fail(size_, errno);
  const bool sized = ::ftruncate(descriptor, static_cast<off_t>(size_)) == 0;
  if (sized) first_ = map_twice(descriptor, size_);
  const int error = errno;
  ::close(descriptor);
  if (first_ == nullptr) fail(size_, error);
}

MirroredMemory::~MirroredMemory() { ::munmap(first_, 2 * size_); }

}  // namespace lbea::tool
