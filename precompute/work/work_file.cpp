#include "precompute/work/work_file.hpp"

#include "precompute/work/stale_files.hpp"

#include <algorithm>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <system_error>

#include <fcntl.h>
#include <unistd.h>

namespace lbea::bake {
namespace {
constexpr std::size_t buffer_size = std::size_t{1} << 20;
constexpr std::uint32_t layout_version = 1;
constexpr std::array<char, 8> work_magic{'\x89', 'L', 'B', 'W', 'F', '\r', '\n', '\x1a'};

struct Header {
  std::array<char, 8> magic = work_magic;
  std::uint32_t version = layout_version;
  std::uint32_t kind = 0;
  std::uint64_t key = 0;
  std::uint64_t content = 0;  // bytes between this header and the checksum
};

std::optional<Header> header_of(int descriptor) {
  Header header;
  if (::pread(descriptor, &header, sizeof(header), 0) != static_cast<ssize_t>(sizeof(header))) return std::nullopt;
  return header;
}

bool is_whole(int descriptor, const Header& header, WorkName name) {
  const off_t size = ::lseek(descriptor, 0, SEEK_END);
  return header.magic == work_magic && header.version == layout_version &&
         header.kind == static_cast<std::uint32_t>(name.kind) && header.key == name.key && size >= 0 &&
         static_cast<std::uint64_t>(size) == sizeof(Header) + header.content + sizeof(std::uint64_t);
}

void write_all(int descriptor, std::span<const std::byte> bytes, const auto& fail) {
  while (!bytes.empty()) {
    const ssize_t n = ::write(descriptor, bytes.data(), bytes.size());
    if (n < 0 && errno == EINTR) continue;
    if (n <= 0) fail(n < 0 ? errno : EIO);
    bytes = bytes.subspan(static_cast<std::size_t>(n));
  }
}
}  // namespace

WorkWriter::WorkWriter(std::filesystem::path file, WorkName name, bool is_durable)
    : file_(std::move(file)), name_(name), is_durable_(is_durable) {
  descriptor_ = create_temporary(file_, "@" + host_name(), temporary_);
  if (descriptor_ < 0) fail("create", errno);
  buffer_.reserve(buffer_size);
  buffer_.resize(sizeof(Header));  // commit() fills it
}

WorkWriter::~WorkWriter() {
  if (descriptor_ >= 0) ::close(descriptor_);
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

void WorkWriter::bytes(std::span<const std::byte> bytes) {
  checksum_.add(bytes);
  size_ += bytes.size();
  if (buffer_.size() + bytes.size() > buffer_size) flush();
  if (bytes.size() > buffer_size)
    write_all(descriptor_, bytes, [this](int error) { fail("write", error); });
  else
    buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

void WorkWriter::flush() {
  write_all(descriptor_, buffer_, [this](int error) { fail("write", error); });
  buffer_.clear();
}

void WorkWriter::commit() {
  const std::uint64_t hash = checksum_.value();
  const auto end = std::as_bytes(std::span(&hash, 1));
  buffer_.insert(buffer_.end(), end.begin(), end.end());
  flush();
  Header header;
  header.kind = static_cast<std::uint32_t>(name_.kind);
  header.key = name_.key;
  header.content = size_;
  if (::pwrite(descriptor_, &header, sizeof(header), 0) != static_cast<ssize_t>(sizeof(header))) fail("write", errno);
  if (is_durable_ && ::fsync(descriptor_) != 0) fail("flush", errno);
  if (::close(std::exchange(descriptor_, -1)) != 0) fail("close", errno);
  const int error = ::rename(temporary_.c_str(), file_.c_str()) == 0 ? 0 : errno;
  // Another process that finished the same file first may have removed this temporary one.
  if (error != 0 && !(error == ENOENT && is_finished(file_, name_))) fail("rename the finished file to", error);
  temporary_.clear();
  if (is_durable_) flush_folder_of(file_);
}

void WorkWriter::fail(const char* action, int error) const {
  throw Error(Status::write_failed, std::string("cannot ") + action + " " + file_.string() + ": " +
                                        std::generic_category().message(error) +
                                        "; check the folder, its rights and the free space");
}

WorkReader::WorkReader(std::filesystem::path file, WorkName name)
    : file_(std::move(file)), descriptor_(::open(file_.c_str(), O_RDONLY | O_CLOEXEC)), buffer_(buffer_size) {
  if (descriptor_ < 0) fail_to_read("cannot be opened");
  try {
    const auto header = header_of(descriptor_);
    if (!header || !is_whole(descriptor_, *header, name)) fail("was not written by this bake, or is truncated");
    rest_ = header->content;
    if (::lseek(descriptor_, sizeof(Header), SEEK_SET) < 0) fail_to_read("cannot be read");
    ::posix_fadvise(descriptor_, 0, 0, POSIX_FADV_SEQUENTIAL);
  } catch (...) {  // the destructor does not run
    ::close(descriptor_);
    throw;
  }
}

WorkReader::~WorkReader() { ::close(descriptor_); }

void WorkReader::bytes(std::span<std::byte> bytes) {
  if (bytes.size() > rest_) fail("ends too early");
  rest_ -= bytes.size();
  read(bytes);
  checksum_.add(bytes);
}

void WorkReader::read(std::span<std::byte> bytes) {
  while (!bytes.empty()) {
    if (next_ == filled_) {
      const ssize_t n = ::read(descriptor_, buffer_.data(), buffer_.size());
      if (n < 0 && errno == EINTR) continue;
      if (n == 0) fail("ends too early");
      if (n < 0) fail_to_read("cannot be read");
      next_ = 0;
      filled_ = static_cast<std::size_t>(n);
    }
    const std::size_t count = std::min(bytes.size(), filled_ - next_);
    std::copy_n(buffer_.begin() + static_cast<std::ptrdiff_t>(next_), count, bytes.begin());
    next_ += count;
    bytes = bytes.subspan(count);
  }
}

void WorkReader::finish() {
  std::uint64_t expected = 0;
  if (rest_ != 0) fail("has more in it than it should");
  read(std::as_writable_bytes(std::span(&expected, 1)));
  if (checksum_.value() != expected) fail("is damaged");
}

void WorkReader::fail(const char* what) const { throw DamagedWorkFile(file_, file_.string() + " " + what); }

void WorkReader::fail_to_read(const char* what) const {
  throw Error(Status::bad_input, file_.string() + " " + what + ": " + std::generic_category().message(errno));
}

const std::string& host_name() {
  static const std::string name = [] {
    std::array<char, 256> text{};
    return ::gethostname(text.data(), text.size() - 1) == 0 ? std::string(text.data()) : std::string("localhost");
  }();
  return name;
}

std::optional<TemporaryName> parse_temporary(const std::string& file_name) {
  const auto at = file_name.find(temporary_file), host = file_name.find('@');
  if (at == std::string::npos || host == std::string::npos || host < at) return std::nullopt;
  TemporaryName name{file_name.substr(0, at), file_name.substr(host + 1)};
  const char* const digits = file_name.data() + at + std::strlen(temporary_file);
  const auto [end, error] = std::from_chars(digits, file_name.data() + host, name.process);
  return error == std::errc{} && *end == '-' && name.process > 0 ? std::optional(name) : std::nullopt;
}

bool is_finished(const std::filesystem::path& file, WorkName name) {
  const int descriptor = ::open(file.c_str(), O_RDONLY | O_CLOEXEC);
  if (descriptor < 0) return false;
  const auto header = header_of(descriptor);
  const bool whole = header && is_whole(descriptor, *header, name);
  ::close(descriptor);
  return whole;
}
}  // namespace lbea::bake
