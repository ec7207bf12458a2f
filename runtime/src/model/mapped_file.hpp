// A file mapped read-only, and control over which parts of it are in memory.
#pragma once

#include <cstddef>
#include <filesystem>
#include <span>

namespace lbea {

class MappedFile {
 public:
  /// Throws Error{file_not_found} when the file cannot be opened or mapped.
  explicit MappedFile(const std::filesystem::path& file);
  ~MappedFile();
  MappedFile(const MappedFile&) = delete;
  MappedFile& operator=(const MappedFile&) = delete;
  [[nodiscard]] std::span<const std::byte> bytes() const noexcept { return bytes_; }
  /// Tells the system whether the file is read from front to end.
  void expect_sequential(bool is_sequential) const noexcept;

 private:
  std::span<const std::byte> bytes_;
};

/// Releases the memory of a part of a mapping. Later reads load it from the file again.
void release_pages(std::span<const std::byte> bytes) noexcept;
/// Loads a part of a mapping into memory.
void load_pages(std::span<const std::byte> bytes) noexcept;
/// Locks or unlocks a part of a mapping in memory. False, with errno, when the system refuses.
bool lock_pages(std::span<const std::byte> bytes, bool is_locked) noexcept;

}  // namespace lbea
