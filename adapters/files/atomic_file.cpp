#include "adapters/files/atomic_file.hpp"

#include "adapters/files/system_files.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <system_error>
#include <utility>

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
    const std::string suffix = ".tmp-" + std::to_string(system::process_id()) + "-" + std::to_string(i);
    temporary_ = path_;
    temporary_ += suffix;
    descriptor_ = system::create_file(temporary_);
    error = descriptor_ >= 0 ? 0 : errno;
  }
  if (descriptor_ < 0) fail("create", error);
}

AtomicFile::~AtomicFile() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) system::remove_file(temporary_);
}

void AtomicFile::write(std::span<const std::byte> bytes) {
  if (buffer_.size() + bytes.size() > buffer_size) flush();
  if (bytes.size() > buffer_size) return write_through(bytes);
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void AtomicFile::commit() {
  flush();
  if (const int error = system::flush(descriptor_); error != 0) fail("flush", error);
  close_descriptor();
  if (const int error = system::replace_file(temporary_, path_); error != 0) fail("rename the finished file to", error);
  temporary_.clear();
  sync_folder();
}

void AtomicFile::flush() {
  write_through(buffer_);
  buffer_.clear();
}

void AtomicFile::write_through(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const std::int64_t n = system::write_some(descriptor_, bytes.first(std::min(bytes.size(), largest_transfer)));
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail("write", n < 0 ? errno : EIO);
    written_ += static_cast<std::uint64_t>(n);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}

void AtomicFile::close_descriptor() {
  if (::close(std::exchange(descriptor_, -1)) != 0) fail("close", errno);
}

// The rename is on the disk only when the folder is.
void AtomicFile::sync_folder() const {
  const int error = system::flush_folder(folder_of(path_));
  if (error == 0) return;
  system::remove_file(path_);  // after an error the caller must not find the file
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

InputFile::InputFile(const std::filesystem::path& path) : name_(path.string()), file_(system::open_file(path)) {
  if (file_.value() < 0 && (errno == ENOENT || errno == ENOTDIR))
    throw Error(Status::file_not_found, "there is no file " + name_);
  const auto facts = file_.value() < 0 ? std::nullopt : system::facts_of(file_.value());
  if (!facts) fail(0, reason(errno));
  if (!facts->is_regular) fail(0, "it is not a regular file");
  size_ = facts->bytes;
}

void InputFile::read(std::uint64_t offset, std::span<std::byte> into) const {
  while (!into.empty()) {
    const std::int64_t n =
        system::read_some(file_.value(), offset, into.first(std::min(into.size(), largest_transfer)));
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
