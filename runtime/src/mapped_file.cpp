#include "runtime/src/mapped_file.hpp"

#include <lbea/lbea.hpp>

#include <cerrno>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace lbea {

namespace {

class Descriptor {
 public:
  explicit Descriptor(const char* path) : value_(::open(path, O_RDONLY | O_CLOEXEC)) {}
  ~Descriptor() {
    if (value_ >= 0) ::close(value_);
  }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  [[nodiscard]] int value() const noexcept { return value_; }

 private:
  int value_;
};

[[noreturn]] void fail(const std::filesystem::path& file, const char* what) {
  throw Error(Status::file_not_found, file.string() + ": " + what + ": " + std::strerror(errno));
}

}  // namespace

MappedFile::MappedFile(const std::filesystem::path& file) {
  const Descriptor descriptor(file.c_str());
  if (descriptor.value() < 0) fail(file, "cannot open the model");
  struct stat info {};
  if (::fstat(descriptor.value(), &info) != 0) fail(file, "cannot ask for the size of the model");
  if (!S_ISREG(info.st_mode)) throw Error(Status::not_a_model, file.string() + ": not a regular file");
  if (info.st_size == 0) return;
  const auto size = static_cast<std::size_t>(info.st_size);
  // Read ahead now: after set-up the loop should meet no page that is not in memory.
  void* address = ::mmap(nullptr, size, PROT_READ, MAP_SHARED | MAP_POPULATE, descriptor.value(), 0);
  if (address == MAP_FAILED) fail(file, "cannot map the model");
  bytes_ = {static_cast<const std::byte*>(address), size};
}

MappedFile::~MappedFile() {
  // munmap wants the address without const; the mapping itself was never writable.
  if (!bytes_.empty()) ::munmap(const_cast<std::byte*>(bytes_.data()), bytes_.size());
}

}  // namespace lbea
