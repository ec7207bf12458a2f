#include "adapters/files/system_files.hpp"

#include "runtime/src/model/descriptor.hpp"

#include <cerrno>
#include <cstdlib>
#include <string>

#include <fcntl.h>
#include <sys/stat.h>

namespace lbea::io::system {
// Not mkstemp: it creates with mode 0600, but the file should have the permissions of an ordinary new file.
int create_file(const std::filesystem::path& file) noexcept {
  return ::open(file.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
}

int open_file(const std::filesystem::path& file) noexcept {
  return ::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK);
}

std::optional<FileFacts> facts_of(int descriptor) noexcept {
  struct stat about {};
  if (::fstat(descriptor, &about) != 0) return std::nullopt;
  return FileFacts{S_ISREG(about.st_mode), static_cast<std::uint64_t>(about.st_size)};
}

std::int64_t write_some(int descriptor, std::span<const std::byte> bytes) noexcept {
  return ::write(descriptor, bytes.data(), bytes.size());
}

std::int64_t read_some(int descriptor, std::uint64_t offset, std::span<std::byte> into) noexcept {
  return ::pread(descriptor, into.data(), into.size(), static_cast<off_t>(offset));
}

void expect_sequential(int descriptor) noexcept { ::posix_fadvise(descriptor, 0, 0, POSIX_FADV_SEQUENTIAL); }

int flush(int descriptor) noexcept { return ::fsync(descriptor) == 0 ? 0 : errno; }

// Some file systems do not support it (EINVAL), and a folder may be writable but not readable.
int flush_folder(const std::filesystem::path& folder) noexcept {
  const Descriptor open(::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
  const int error = open.value() < 0 ? 0 : flush(open.value());
  return error == EINVAL ? 0 : error;
}

int replace_file(const std::filesystem::path& from, const std::filesystem::path& to) noexcept {
  return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno;
}

void remove_file(const std::filesystem::path& file) noexcept { ::unlink(file.c_str()); }

std::filesystem::path create_temporary_folder(const std::filesystem::path& parent) {
  std::string name = (parent / ".lbea-XXXXXX").string();
  return ::mkdtemp(name.data()) != nullptr ? std::filesystem::path(name) : std::filesystem::path();
}

int process_id() noexcept { return ::getpid(); }
}  // namespace lbea::io::system
