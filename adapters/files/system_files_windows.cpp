#include "adapters/files/system_files.hpp"

#include <algorithm>
#include <cerrno>
#include <string>
#include <system_error>

#include <fcntl.h>
#include <io.h>
#include <process.h>
#include <sys/stat.h>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

namespace lbea::io::system {
namespace {
constexpr std::size_t largest_transfer = std::size_t{1} << 30;
constexpr int temporary_names = 1000;

int error_number(DWORD error) noexcept {
  const auto condition = std::system_category().default_error_condition(static_cast<int>(error));
  return condition.category() == std::generic_category() ? condition.value() : EIO;
}

HANDLE handle_of(int descriptor) noexcept { return reinterpret_cast<HANDLE>(::_get_osfhandle(descriptor)); }
}  // namespace

int create_file(const std::filesystem::path& file) noexcept {
  return ::_wopen(file.c_str(), _O_WRONLY | _O_CREAT | _O_EXCL | _O_BINARY | _O_NOINHERIT, _S_IREAD | _S_IWRITE);
}

int open_file(const std::filesystem::path& file) noexcept {
  const int descriptor = ::_wopen(file.c_str(), _O_RDONLY | _O_BINARY | _O_NOINHERIT);
  const int error = errno;
  std::error_code unknown;
  errno = descriptor < 0 && std::filesystem::is_directory(file, unknown) ? EISDIR : error;
  return descriptor;
}

std::optional<FileFacts> facts_of(int descriptor) noexcept {
  struct _stat64 about {};
  if (::_fstat64(descriptor, &about) != 0) return std::nullopt;
  return FileFacts{(about.st_mode & _S_IFMT) == _S_IFREG, static_cast<std::uint64_t>(about.st_size)};
}

std::int64_t write_some(int descriptor, std::span<const std::byte> bytes) noexcept {
  return ::_write(descriptor, bytes.data(), static_cast<unsigned>(std::min(bytes.size(), largest_transfer)));
}

std::int64_t read_some(int descriptor, std::uint64_t offset, std::span<std::byte> into) noexcept {
  OVERLAPPED place{};
  place.Offset = static_cast<DWORD>(offset);
  place.OffsetHigh = static_cast<DWORD>(offset >> 32);
  DWORD read = 0;
  const auto most = static_cast<DWORD>(std::min(into.size(), largest_transfer));
  if (::ReadFile(handle_of(descriptor), into.data(), most, &read, &place) != 0) return read;
  const DWORD error = ::GetLastError();
  if (error == ERROR_HANDLE_EOF) return 0;
  errno = error_number(error);
  return -1;
}

void expect_sequential(int) noexcept {}  // Windows detects it

int flush(int descriptor) noexcept { return ::_commit(descriptor) == 0 ? 0 : errno; }

int flush_folder(const std::filesystem::path&) noexcept { return 0; }  // replace_file() waits for the disk

int replace_file(const std::filesystem::path& from, const std::filesystem::path& to) noexcept {
  constexpr DWORD how = MOVEFILE_REPLACE_EXISTING | MOVEFILE_WRITE_THROUGH;
  return ::MoveFileExW(from.c_str(), to.c_str(), how) != 0 ? 0 : error_number(::GetLastError());
}

void remove_file(const std::filesystem::path& file) noexcept { ::_wunlink(file.c_str()); }

std::filesystem::path create_temporary_folder(const std::filesystem::path& parent) {
  for (int i = 0; i < temporary_names; ++i) {
    auto folder = parent / (".lbea-" + std::to_string(process_id()) + "-" + std::to_string(i));
    if (::CreateDirectoryW(folder.c_str(), nullptr) != 0) return folder;
    errno = error_number(::GetLastError());
    if (errno != EEXIST) break;
  }
  return {};
}

int process_id() noexcept { return ::_getpid(); }
}  // namespace lbea::io::system
