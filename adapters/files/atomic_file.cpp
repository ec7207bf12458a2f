#include "adapters/files/atomic_file.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <fcntl.h>
#include <sys/stat.h>

namespace lbea::io {
namespace {
constexpr std::size_t buffer_size = std::size_t{1} << 18;
constexpr std::size_t largest_transfer = std::size_t{1} << 30;  // one read() or write() moves at most 2^31 - 4096 bytes
constexpr int temporary_names = 1000;

std::string reason(int error) { return std::generic_category().message(error); }

std::filesystem::path folder_of(const std::filesystem::path& path) {
  return path.has_parent_path() ? path.parent_path() : std::filesystem::path(".");
}
}  // namespace

AtomicFile::AtomicFile(std::filesystem::path path) : path_(std::move(path)) {
  if (!path_.has_filename()) fail("create", EISDIR);
  std::error_code missing;
  if (std::filesystem::exists(path_, missing)) path_ = std::filesystem::canonical(path_);  // follows a link
  if (std::filesystem::exists(path_, missing) && !std::filesystem::is_regular_file(path_))
    throw Error(Status::write_failed, path_.string() + ": exists and is not a regular file; choose another name");
  buffer_.reserve(buffer_size);
  int error = EEXIST;
  for (int i = 0; i < temporary_names && error == EEXIST; ++i) {
    // Not mkstemp: it creates with mode 0600, but the file should have the permissions of an ordinary new file.
    const std::string suffix = ".tmp-" + std::to_string(::getpid()) + "-" + std::to_string(i);
    temporary_ = folder_of(path_) / (path_.filename().string() + suffix);
    descriptor_ = ::open(temporary_.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    error = descriptor_ >= 0 ? 0 : errno;
  }
  if (descriptor_ < 0) fail("create", error);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > buffer_size) flush();
  if (bytes.size() > buffer_size) return write_through(bytes);
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void AtomicFile::commit() {
  flush();
  if (::fsync(descriptor_) != 0) fail("flush", errno);
  close_descriptor();
  if (::rename(temporary_.c_str(), path_.c_str()) != 0) fail("rename the finished file to", errno);
  temporary_.clear();
  sync_folder();
}

void AtomicFile::flush() {
  write_through(buffer_);
  buffer_.clear();
}

void AtomicFile::write_through(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor_, bytes.data(), std::min(bytes.size(), largest_transfer));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail("write", n < 0 ? errno : EIO);
    written_ += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void AtomicFile::close_descriptor() {
  if (::close(std::exchange(descriptor_, -1)) != 0) fail("close", errno);
}

// The rename is on the disk only when the folder is. Some file systems do not support that (EINVAL), and a folder may
// be writable but not readable; the file is complete in both cases.
void AtomicFile::sync_folder() const {
  const Descriptor folder(::open(folder_of(path_).c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const int error = folder.value() < 0 || ::fsync(folder.value()) == 0 ? 0 : errno;
  if (error == 0 || error == EINVAL) return;
  ::unlink(path_.c_str());  // after an error the caller must not find the file
  fail("flush the folder of", error);
}

void AtomicFile::fail(const std::string& action, int error) const {
  throw Error(Status::write_failed, "cannot " + action + " " + path_.string() + " (byte " + std::to_string(written_) +
                                        "): " + reason(error) + "; check the folder, its rights and the free space");
}

void write_file(const std::filesystem::path& path, std::string_view text) {
  AtomicFile file(path);
  file.write(text);
  file.commit();
}

InputFile::InputFile(const std::filesystem::path& path)
    : name_(path.string()), file_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (file_.value() < 0 && (errno == ENOENT || errno == ENOTDIR))
    throw Error(Status::file_not_found, "there is no file " + name_);
  struct stat about {};
  if (file_.value() < 0 || ::fstat(file_.value(), &about) != 0) fail(0, reason(errno));
  if (!S_ISREG(about.st_mode)) fail(0, "it is not a regular file");
  size_ = static_cast<std::uint64_t>(about.st_size);
}

void InputFile::read(std::uint64_t offset, std::span<std::byte> into) const {
  while (!into.empty()) {
    const ssize_t n =
        ::pread(file_.value(), into.data(), std::min(into.size(), largest_transfer), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(offset, n < 0 ? reason(errno) : "the file became shorter while it was read");
    offset += static_cast<std::uint64_t>(n);
    into = into.subspan(static_cast<std::size_t>(n));
  }
}

void InputFile::fail(std::uint64_t byte, const std::string& why) const {
  throw Error(Status::bad_input, "cannot read " + name_ + " (byte " + std::to_string(byte) + "): " + why);
}

std::vector<std::byte> read_file(const std::filesystem::path& path) {
  const InputFile file(path);
  std::vector<std::byte> bytes(static_cast<std::size_t>(file.size()));
  file.read(0, bytes);
  return bytes;
}
}  // namespace lbea::io
