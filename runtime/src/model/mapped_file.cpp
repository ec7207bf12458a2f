#include "runtime/src/model/mapped_file.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>

namespace lbea {
namespace {
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
              name_of(file) + ": " + what + ": " + std::strerror(errno) + "; check its path and permissions");
}
}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file)
    : file_(file), open_(::open(file.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)) {
  if (open_.value() < 0) fail(file, "cannot open the model");
  struct stat info {};
  if (::fstat(open_.value(), &info) != 0) fail(file, "cannot read the size of the model");
  if (!S_ISREG(info.st_mode)) throw Error(Status::not_a_model, name_of(file) + ": not a regular file");
  opened_ = version();
  if (info.st_size == 0) return;
  const auto size = static_cast<std::size_t>(info.st_size);
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED, open_.value(), 0);
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

void MappedFile::hold(std::span<const std::byte> part) const {
  auto pages = pages_of(part);
  const auto whole = pages;
  constexpr int flags = MAP_PRIVATE | MAP_ANONYMOUS | MAP_FIXED;
  auto offset = static_cast<off_t>(pages.data() - bytes_.data());
  if (::mmap(pages.data(), pages.size(), PROT_READ | PROT_WRITE, flags, -1, 0) == MAP_FAILED)
    throw Error(Status::bad_config, name_of(file_) + ": no memory for a copy of the model: " + std::strerror(errno));
  ::madvise(whole.data(), whole.size(), MADV_HUGEPAGE);  // searches read samples in any order; if refused, only slower
  while (!pages.empty() && offset < static_cast<off_t>(bytes_.size())) {
    const ssize_t read = ::pread(open_.value(), pages.data(), pages.size(), offset);
    if (read < 0 && errno == EINTR) continue;
    if (read <= 0) throw Error(Status::corrupt_model, name_of(file_) + ": changed while it was read; start again");
    offset += read;
    pages = pages.subspan(static_cast<std::size_t>(read));
  }
  ::mprotect(whole.data(), whole.size(), PROT_READ);
}

MappedFile::Version MappedFile::version() const noexcept {
  struct stat info {};
  if (::fstat(open_.value(), &info) != 0) return {};
  return {info.st_size, info.st_mtim.tv_sec, info.st_mtim.tv_nsec};
}

bool MappedFile::was_written() const noexcept { return version() != opened_; }

std::string name_of(const std::filesystem::path& file) { return file.string(); }

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

std::uint64_t memory_of_machine() noexcept {
  return static_cast<std::uint64_t>(::sysconf(_SC_PHYS_PAGES)) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
}
}  // namespace lbea
