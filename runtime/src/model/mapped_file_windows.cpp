#include "runtime/src/model/mapped_file.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <string>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

namespace lbea {
namespace {
constexpr std::size_t page = 4096;

/// The whole pages that hold `bytes`.
std::span<std::byte> pages_of(std::span<const std::byte> bytes) noexcept {
  const auto begin = reinterpret_cast<std::uintptr_t>(bytes.data()), first = begin / page * page;
  const auto end = (begin + bytes.size() + page - 1) / page * page;
  // The system's functions take an address without const.
  return {const_cast<std::byte*>(bytes.data()) - (begin - first), end - first};
}

std::string to_utf8(const wchar_t* text, int length) {
  std::string utf8(static_cast<std::size_t>(3 * length), '\0');
  const int used =
      ::WideCharToMultiByte(CP_UTF8, 0, text, length, utf8.data(), static_cast<int>(utf8.size()), nullptr, nullptr);
  utf8.resize(static_cast<std::size_t>(used));
  return utf8;
}

/// The system's sentence about an error, in the user's language.
std::string sentence_of(DWORD error) {
  wchar_t text[512];
  DWORD length = ::FormatMessageW(FORMAT_MESSAGE_FROM_SYSTEM | FORMAT_MESSAGE_IGNORE_INSERTS, nullptr, error, 0, text,
                                  static_cast<DWORD>(std::size(text)), nullptr);
  while (length > 0 && (text[length - 1] <= L' ' || text[length - 1] == L'.')) --length;
  return length > 0 ? to_utf8(text, static_cast<int>(length)) : "error " + std::to_string(error);
}

[[noreturn]] void fail(const std::filesystem::path& file, const char* what, DWORD error = ::GetLastError()) {
  const char* const remedy =
      error == ERROR_SHARING_VIOLATION ? "; close the program that writes it" : "; check its path and permissions";
  throw Error(Status::file_not_found, name_of(file) + ": " + what + ": " + sentence_of(error) + remedy);
}

std::int64_t joined(DWORD high, DWORD low) noexcept { return static_cast<std::int64_t>(high) << 32 | low; }
}  // namespace

WindowsFile::WindowsFile(const std::filesystem::path& file)
    : handle_(::CreateFileW(file.c_str(), GENERIC_READ, FILE_SHARE_READ | FILE_SHARE_DELETE, nullptr, OPEN_EXISTING,
                            FILE_ATTRIBUTE_NORMAL, nullptr)) {
  const DWORD error = ::GetLastError();
  std::error_code ignored;
  const bool is_open = handle_ != INVALID_HANDLE_VALUE;
  if (is_open ? ::GetFileType(handle_) != FILE_TYPE_DISK : std::filesystem::is_directory(file, ignored)) {
    if (is_open) ::CloseHandle(handle_);
    throw Error(Status::not_a_model, name_of(file) + ": not a regular file");
  }
  if (!is_open) fail(file, "cannot open the model", error);
}

WindowsFile::~WindowsFile() { ::CloseHandle(handle_); }

// Copy on write, so that hold() can replace pages in place.
MappedFile::MappedFile(const std::filesystem::path& file) : file_(file), open_(file), opened_(version()) {
  if (opened_.bytes < 0) fail(file, "cannot read the size of the model");
  if (opened_.bytes == 0) return;
  void* const mapping = ::CreateFileMappingW(open_.handle(), nullptr, PAGE_WRITECOPY, 0, 0, nullptr);
  if (mapping == nullptr) fail(file, "cannot map the model");
  const void* const address = ::MapViewOfFile(mapping, FILE_MAP_COPY, 0, 0, 0);
  const DWORD error = ::GetLastError();
  ::CloseHandle(mapping);
  if (address == nullptr) fail(file, "cannot map the model", error);
  bytes_ = {static_cast<const std::byte*>(address), static_cast<std::size_t>(opened_.bytes)};
  DWORD before = 0;
  const auto pages = pages_of(bytes_);
  ::VirtualProtect(pages.data(), pages.size(), PAGE_READONLY, &before);
}

MappedFile::~MappedFile() {
  if (!bytes_.empty()) ::UnmapViewOfFile(bytes_.data());
}

void MappedFile::expect_sequential(bool) const noexcept {}  // Windows detects it

void MappedFile::hold(std::span<const std::byte> part) const {
  const auto pages = pages_of(part);
  DWORD before = 0;
  if (::VirtualProtect(pages.data(), pages.size(), PAGE_WRITECOPY, &before) == 0)
    throw Error(Status::bad_config,
                name_of(file_) + ": no memory for a copy of the model: " + sentence_of(::GetLastError()));
  for (std::size_t at = 0; at < pages.size(); at += page) {
    volatile std::byte& first = pages[at];  // writing to a page copies it
    first = first;
  }
  ::VirtualProtect(pages.data(), pages.size(), PAGE_READONLY, &before);
}

MappedFile::Version MappedFile::version() const noexcept {
  BY_HANDLE_FILE_INFORMATION info{};
  if (::GetFileInformationByHandle(open_.handle(), &info) == 0) return {};
  constexpr std::int64_t per_second = 10'000'000;
  const std::int64_t written = joined(info.ftLastWriteTime.dwHighDateTime, info.ftLastWriteTime.dwLowDateTime);
  return {joined(info.nFileSizeHigh, info.nFileSizeLow), written / per_second, written % per_second * 100};
}

bool MappedFile::was_written() const noexcept { return version() != opened_; }

std::string name_of(const std::filesystem::path& file) {
  return to_utf8(file.c_str(), static_cast<int>(file.native().size()));
}

void release_pages(std::span<const std::byte> bytes) noexcept {
  const auto pages = pages_of(bytes);
  ::VirtualUnlock(pages.data(), pages.size());  // removes pages that are not locked from the process's memory
}

void load_pages(std::span<const std::byte> bytes) noexcept {
  const auto pages = pages_of(bytes);
  const volatile std::byte* const begin = pages.data();
  for (std::size_t at = 0; at < pages.size(); at += page) static_cast<void>(begin[at]);
}

bool lock_pages(std::span<const std::byte> bytes, bool is_locked) noexcept {
  const auto pages = pages_of(bytes);
  if ((is_locked ? ::VirtualLock(pages.data(), pages.size()) : ::VirtualUnlock(pages.data(), pages.size())) != 0)
    return true;
  errno = ENOMEM;
  return false;
}

std::uint64_t memory_of_machine() noexcept {
  MEMORYSTATUSEX memory{};
  memory.dwLength = sizeof(memory);
  ::GlobalMemoryStatusEx(&memory);
  return memory.ullTotalPhys;
}
}  // namespace lbea
