#include "tools/shared/system/mirrored_memory.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <limits>
#include <string>
#include <system_error>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

namespace lbea::tool {
namespace {

constexpr int most_attempts = 100;

[[noreturn]] void fail(std::size_t bytes, DWORD error) {
  throw Error(Status::bad_config, "a recording buffer of " + std::to_string(bytes >> 20) + " MB: " +
                                      std::system_category().message(static_cast<int>(error)) + "; request less");
}

/// Views begin at multiples of the system's granularity.
std::size_t whole_views(std::size_t bytes) {
  SYSTEM_INFO system{};
  ::GetSystemInfo(&system);
  const std::size_t granularity = system.dwAllocationGranularity;
  if (bytes > std::numeric_limits<std::size_t>::max() / 4) fail(bytes, ERROR_NOT_ENOUGH_MEMORY);
  return std::max<std::size_t>(1, (bytes + granularity - 1) / granularity) * granularity;
}

/// Null when a view cannot be there: another thread may have taken the addresses.
std::byte* map_twice(HANDLE mapping, std::size_t bytes) noexcept {
  void* const both = ::VirtualAlloc(nullptr, 2 * bytes, MEM_RESERVE, PAGE_NOACCESS);
  if (both == nullptr) return nullptr;
  ::VirtualFree(both, 0, MEM_RELEASE);
  auto* const first = static_cast<std::byte*>(both);
  if (::MapViewOfFileEx(mapping, FILE_MAP_ALL_ACCESS, 0, 0, bytes, first) == nullptr) return nullptr;
  if (::MapViewOfFileEx(mapping, FILE_MAP_ALL_ACCESS, 0, 0, bytes, first + bytes) != nullptr) return first;
  ::UnmapViewOfFile(first);
  return nullptr;
}

void touch(std::byte* first, std::size_t bytes) noexcept {
  constexpr std::size_t page = 4096;
  for (std::size_t at = 0; at < bytes; at += page) static_cast<volatile std::byte&>(first[at]) = std::byte{0};
}

}  // namespace

MirroredMemory::MirroredMemory(std::size_t bytes) : size_(whole_views(bytes)) {
  const HANDLE mapping =
      ::CreateFileMappingW(INVALID_HANDLE_VALUE, nullptr, PAGE_READWRITE,
                           static_cast<DWORD>(std::uint64_t{size_} >> 32), static_cast<DWORD>(size_), nullptr);
  if (mapping == nullptr) fail(size_, ::GetLastError());
  for (int i = 0; i < most_attempts && first_ == nullptr; ++i) first_ = map_twice(mapping, size_);
  const DWORD error = ::GetLastError();
  ::CloseHandle(mapping);
  if (first_ == nullptr) fail(size_, error);
  touch(first_, 2 * size_);
}

MirroredMemory::~MirroredMemory() {
  ::UnmapViewOfFile(first_ + size_);
  ::UnmapViewOfFile(first_);
}

}  // namespace lbea::tool
