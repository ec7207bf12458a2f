#include "runtime/src/model/mapped_file.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lbea {
namespace {

class Descriptor {
 public:
  explicit Descriptor(const char* path) : value_(::open(path, O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int value() const noexcept { return value_; }

 private:
  int value_;
};

/// The whole pages that hold `bytes`.
std::span<std::byte> pages_of(std::span<const std::byte> bytes) noexcept {
  static const auto page = static_cast<std::uintptr_t>(::sysconf(_SC_PAGESIZE));
  const auto begin = reinterpret_cast<std::uintptr_t>(bytes.data()), first = begin / page * page;
  const auto end = (begin + bytes.size() + page - 1) / page * page;
  // madvise takes an address without const.
  return {const_cast<std::byte*>(bytes.data()) - (begin - first), end - first};
}

[[noreturn]] void fail(const std::filesystem::path& file, const char* what) {
  throw Error(Status::file_not_found,
              file.string() + ": " + what + ": " + std::strerror(errno) + "; check its path and permissions");
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file) {
  const Descriptor descriptor(file.c_str());
  if (descriptor.value() < 0) fail(file, "cannot open the model");
  struct stat info {};
  if (::fstat(descriptor.value(), &info) != 0) fail(file, "cannot read the size of the model");
  if (!S_ISREG(info.st_mode)) throw Error(Status::not_a_model, file.string() + ": not a regular file");
  if (info.st_size == 0) return;
  const auto size = static_cast<std::size_t>(info.st_size);
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, descriptor.value(), 0);
  if (address == MAP_FAILED) fail(file, "cannot map the model");
  bytes_ = {static_cast<const std::byte*>(address), size};
}

MappedFile::~MappedFile() {
  // munmap takes an address without const; the mapping is read-only.
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

void MappedFile::expect_sequential(bool is_sequential) const noexcept {
  if (!bytes_.empty())
    ::madvise(const_cast<std::byte*>(bytes_.data()), bytes_.size(), is_sequential ? MADV_SEQUENTIAL : MADV_NORMAL);
}

void release_pages(std::span<const std::byte> bytes) noexcept {
  const auto pages = pages_of(bytes);
  ::madvise(pages.data(), pages.size(), MADV_DONTNEED);
}

void load_pages(std::span<const std::byte> bytes) noexcept {
  const auto pages = pages_of(bytes);
#ifdef MADV_POPULATE_READ
  if (::madvise(pages.data(), pages.size(), MADV_POPULATE_READ) == 0) return;
#endif
  const volatile std::byte* const begin = pages.data();
  for (std::size_t at = 0; at < pages.size(); at += 4096) static_cast<void>(begin[at]);
}

bool lock_pages(std::span<const std::byte> bytes, bool is_locked) noexcept {
  const auto pages = pages_of(bytes);
  return (is_locked ? ::mlock(pages.data(), pages.size()) : ::munlock(pages.data(), pages.size())) == 0;
}

}  // namespace lbea
