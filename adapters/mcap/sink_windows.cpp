// Nobody else can write to, rename or remove a file on Windows while it is open as here.
#include "adapters/mcap/sink.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

#include <fcntl.h>
#include <io.h>

#define WIN32_LEAN_AND_MEAN
#include <windows.h>

namespace lbea::mcap {
namespace {
constexpr std::size_t largest_transfer = std::size_t{1} << 30;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& why) {
  throw Error(Status::write_failed, "cannot record to " + file.string() + ": " + why);
}

int last_error() noexcept {
  const auto condition = std::system_category().default_error_condition(static_cast<int>(::GetLastError()));
  return condition.category() == std::generic_category() ? condition.value() : EIO;
}

bool is_there(const std::filesystem::path& file) noexcept {
  return ::GetFileAttributesW(file.c_str()) != INVALID_FILE_ATTRIBUTES;
}

/// -1 with errno on failure.
int create(const std::filesystem::path& file) noexcept {
  const HANDLE handle = ::CreateFileW(file.c_str(), GENERIC_READ | GENERIC_WRITE, FILE_SHARE_READ, nullptr, CREATE_NEW,
                                      FILE_ATTRIBUTE_NORMAL, nullptr);
  if (handle == INVALID_HANDLE_VALUE) return errno = last_error(), -1;
  return ::_open_osfhandle(reinterpret_cast<std::intptr_t>(handle), _O_RDWR | _O_BINARY);
}

/// 0 or an error number. The system's position in the file is where it writes.
int write_all(int descriptor, Bytes bytes) noexcept {
  while (!bytes.empty()) {
    const auto most = static_cast<unsigned>(std::min(bytes.size(), largest_transfer));
    const int written = ::_write(descriptor, bytes.data(), most);
    if (written <= 0) return written < 0 ? errno : EIO;
    bytes = bytes.subspan(static_cast<std::size_t>(written));
  }
  return 0;
}
}  // namespace

PartialFile::PartialFile(const std::filesystem::path& file, const std::filesystem::path& partial)
    : file_(file), partial_(partial), folder_(file.has_parent_path() ? file.parent_path() : ".") {
  if (!file.has_filename()) fail(file, "it is a folder; add a file name");
  if (is_there(file_)) fail(file, "the file exists and recordings are never overwritten; choose another name");
  descriptor_ = create(partial_);
  if (descriptor_ < 0 && errno == EEXIST)
    fail(file, partial_.string() + " exists, from a recording that is running or was cut off; see " +
                   "lbea-inspect --recover, or choose another name");
  if (descriptor_ < 0) fail(file, std::generic_category().message(errno) + "; check the folder and its permissions");
}

PartialFile::~PartialFile() {
  if (descriptor_ >= 0) ::_close(descriptor_);
  if (!kept_ && !committed_) ::_wunlink(partial_.c_str());
}

int PartialFile::append(std::span<const Bytes> pieces) noexcept {
  if (broken_ != 0) return broken_;
  std::uint64_t bytes = 0;
  for (const Bytes piece : pieces) {
    if (const int error = write_all(descriptor_, piece); error != 0) {
      cut_back();
      return error;
    }
    bytes += piece.size();
  }
  size_ += bytes;
  return 0;
}

void PartialFile::cut_back() noexcept {
  const auto size = static_cast<std::int64_t>(size_);
  if (::_chsize_s(descriptor_, size) != 0 || ::_lseeki64(descriptor_, size, SEEK_SET) != size) broken_ = EIO;
}

std::uint64_t PartialFile::free_bytes() const noexcept {
  ULARGE_INTEGER free{};
  const bool is_known = ::GetDiskFreeSpaceExW(folder_.c_str(), &free, nullptr, nullptr) != 0;
  return is_known ? free.QuadPart : Sink::free_bytes();
}

int PartialFile::sync() noexcept { return ::_commit(descriptor_) == 0 ? 0 : errno; }

// Without MOVEFILE_REPLACE_EXISTING it fails when a file with this name was created in the meantime.
int PartialFile::give_final_name() const noexcept {
  return ::MoveFileExW(partial_.c_str(), file_.c_str(), MOVEFILE_WRITE_THROUGH) != 0 ? 0 : last_error();
}

int PartialFile::commit() noexcept {
  if (broken_ != 0) return broken_;
  if (const int error = sync(); error != 0) return error;
  if (::_close(std::exchange(descriptor_, -1)) != 0) return errno;  // before it can be renamed
  const int error = give_final_name();
  committed_ = error == 0;
  return error;
}
}  // namespace lbea::mcap
