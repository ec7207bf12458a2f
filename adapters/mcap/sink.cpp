#include "adapters/mcap/sink.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/sendfile.h>
#include <sys/stat.h>
#include <sys/statvfs.h>
#include <sys/uio.h>

namespace lbea::mcap {
namespace {
// Write-back is started early and often, because otherwise the system collects gigabytes and then stalls.
constexpr std::uint64_t write_back_bytes = std::uint64_t{8} << 20;
constexpr std::size_t most_pieces = 64;

[[noreturn]] void fail(const std::filesystem::path& file, const std::string& why) {
  throw Error(Status::write_failed, "cannot record to " + file.string() + ": " + why);
}

bool is_there(const std::filesystem::path& file) {
  struct stat about {};
  return ::lstat(file.c_str(), &about) == 0;
}

/// Returns 0 or an error number.
int write_all(int descriptor, std::span<iovec> pieces, std::uint64_t offset) {
  while (!pieces.empty()) {
    const ssize_t n = ::pwritev(descriptor, pieces.data(), static_cast<int>(pieces.size()), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) return errno;
    offset += static_cast<std::uint64_t>(n);
    std::size_t left = static_cast<std::size_t>(n);
    while (!pieces.empty() && left >= pieces[0].iov_len) {
      left -= pieces[0].iov_len;
      pieces = pieces.subspan(1);
    }
    if (pieces.empty()) break;
    if (n == 0) return EIO;
    pieces[0].iov_base = static_cast<std::byte*>(pieces[0].iov_base) + left;
    pieces[0].iov_len -= left;
  }
  return 0;
}

void sync_folder(const std::filesystem::path& folder) noexcept {
  const int descriptor = ::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (descriptor < 0) return;  // the folder may be writable but not readable
  static_cast<void>(::fsync(descriptor));
  ::close(descriptor);
}
}  // namespace

PartialFile::PartialFile(const std::filesystem::path& file, const std::filesystem::path& partial)
    : file_(file), partial_(partial), folder_(file.has_parent_path() ? file.parent_path() : ".") {
  if (!file.has_filename()) fail(file, "it is a folder; add a file name");
  if (is_there(file_)) fail(file, "the file exists and recordings are never overwritten; choose another name");
  descriptor_ = ::open(partial_.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (descriptor_ < 0 && errno == EEXIST)
    fail(file, partial_.string() + " exists, from a recording that is running or was cut off; see " +
                   "lbea-inspect --recover, or choose another name");
  if (descriptor_ < 0) fail(file, std::generic_category().message(errno) + "; check the folder and its permissions");
}

PartialFile::~PartialFile() {
  if (!kept_ && !committed_ && is_named()) ::unlink(partial_.c_str());
  if (descriptor_ >= 0) ::close(descriptor_);
}

int PartialFile::append(std::span<const Bytes> pieces) noexcept {
  if (broken_ != 0) return broken_;
  std::array<iovec, most_pieces> vectors;
  if (pieces.size() > vectors.size()) return E2BIG;
  std::uint64_t bytes = 0;
  for (std::size_t i = 0; i < pieces.size(); ++i) {
    vectors[i] = {const_cast<std::byte*>(pieces[i].data()), pieces[i].size()};  // only read
    bytes += pieces[i].size();
  }
  if (const int error = write_all(descriptor_, std::span(vectors).first(pieces.size()), size_); error != 0) {
    cut_back();
    return error;
  }
  size_ += bytes;
  start_write_back();
  return 0;
}

void PartialFile::cut_back() noexcept {
  if (::ftruncate(descriptor_, static_cast<off_t>(size_)) != 0) broken_ = errno;
}

void PartialFile::start_write_back() noexcept {
  if (size_ - started_ < write_back_bytes) return;
  static_cast<void>(::sync_file_range(descriptor_, static_cast<off_t>(started_), static_cast<off_t>(size_ - started_),
                                      SYNC_FILE_RANGE_WRITE));
  started_ = size_;
}

std::uint64_t PartialFile::free_bytes() const noexcept {
  struct statvfs space {};
  if (::fstatvfs(descriptor_, &space) != 0) return Sink::free_bytes();
  return std::uint64_t{space.f_bavail} * space.f_frsize;
}

int PartialFile::sync() noexcept { return ::fdatasync(descriptor_) == 0 ? 0 : errno; }

/// Whether FILE.partial is still this file: somebody may have removed it, and begun another recording.
bool PartialFile::is_named() const noexcept {
  struct stat mine {
  }, named{};
  return ::fstat(descriptor_, &mine) == 0 && ::lstat(partial_.c_str(), &named) == 0 && mine.st_ino == named.st_ino &&
         mine.st_dev == named.st_dev;
}

int PartialFile::copy_to_final_name() const noexcept {
  const int copy = ::open(file_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
  if (copy < 0) return errno;
  int error = 0;
  for (off_t at = 0; error == 0 && static_cast<std::uint64_t>(at) < size_;) {
    const ssize_t n = ::sendfile(copy, descriptor_, &at, size_ - static_cast<std::uint64_t>(at));
    if (n == 0) error = EIO;
    if (n < 0 && errno != EINTR) error = errno;
  }
  if (error == 0 && ::fsync(copy) != 0) error = errno;
  if (error != 0) ::unlink(file_.c_str());
  ::close(copy);
  return error;
}

// link() fails when a file with this name was created in the meantime; rename() would overwrite it.
int PartialFile::give_final_name() const noexcept {
  if (!is_named()) return copy_to_final_name();
  if (::link(partial_.c_str(), file_.c_str()) == 0) {
    static_cast<void>(::unlink(partial_.c_str()));
    return 0;
  }
  if (errno == EEXIST || is_there(file_)) return EEXIST;
  return ::rename(partial_.c_str(), file_.c_str()) == 0 ? 0 : errno;  // the file system does not support links
}

int PartialFile::commit() noexcept {
  if (broken_ != 0) return broken_;
  if (::fsync(descriptor_) != 0) return errno;
  if (const int error = give_final_name(); error != 0) return error;
  committed_ = true;
  sync_folder(folder_);
  return ::close(std::exchange(descriptor_, -1)) == 0 ? 0 : errno;
}
}  // namespace lbea::mcap
