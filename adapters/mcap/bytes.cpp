#include "adapters/mcap/bytes.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>
#include <system_error>

#include <isa-l/crc.h>
#include <zlib.h>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lbea::mcap {
namespace {

constexpr std::size_t largest_transfer = std::size_t{1} << 30;

[[noreturn]] void fail(const std::string& file, std::uint64_t byte, const std::string& why) {
  throw Error(Status::bad_input, "cannot read " + file + " (byte " + std::to_string(byte) + "): " + why);
}

std::string reason(int error) { return std::generic_category().message(error); }

}  // namespace

std::uint32_t crc32(Bytes bytes, std::uint32_t before) noexcept {
  if (bytes.empty()) return before;
  return crc32_gzip_refl(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size());
}

std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second, std::uint64_t second_bytes) noexcept {
  return static_cast<std::uint32_t>(crc32_combine(first, second, static_cast<z_off_t>(second_bytes)));
}

void MemorySource::read(std::uint64_t offset, std::span<std::byte> into) const {
  const auto from = bytes_.subspan(static_cast<std::size_t>(offset), into.size());
  std::copy(from.begin(), from.end(), into.begin());
}

FileSource::FileSource(const std::filesystem::path& path)
    : name_(path.string()), descriptor_(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (descriptor_ < 0 && (errno == ENOENT || errno == ENOTDIR))
    throw Error(Status::file_not_found, "there is no file " + name_);
  if (descriptor_ < 0) fail(name_, 0, reason(errno));
  struct stat about {};
  const bool regular = ::fstat(descriptor_, &about) == 0 && S_ISREG(about.st_mode);
  if (!regular) {
    ::close(descriptor_);
    fail(name_, 0, "it is not a regular file");
  }
  size_ = static_cast<std::uint64_t>(about.st_size);
  ::posix_fadvise(descriptor_, 0, 0, POSIX_FADV_SEQUENTIAL);
}

FileSource::~FileSource() { ::close(descriptor_); }

void FileSource::read(std::uint64_t offset, std::span<std::byte> into) const {
  while (!into.empty()) {
    const ssize_t n =
        ::pread(descriptor_, into.data(), std::min(into.size(), largest_transfer), static_cast<off_t>(offset));
    if (n < 0 && errno == EINTR) continue;
    if (n < 0) fail(name_, offset, reason(errno));
    if (n == 0) fail(name_, offset, "the file became shorter while it was read");
    offset += static_cast<std::uint64_t>(n);
    into = into.subspan(static_cast<std::size_t>(n));
  }
}

}  // namespace lbea::mcap
