// A whole file, mapped read-only, and what of it is in memory.
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
  /// While all of it is read from front to end.
  void expect_sequential(bool is_sequential) const noexcept;

 private:
  std::span<const std::byte> bytes_;
};

/// Lets go of the memory of a part of a mapping; it comes back from the file when it is read again.
void release_pages(std::span<const std::byte> bytes) noexcept;
/// Reads a part of a mapping into memory, now.
void load_pages(std::span<const std::byte> bytes) noexcept;
/// Keeps a part of a mapping in memory, or no longer. False, and errno, when the system refuses.
bool lock_pages(std::span<const std::byte> bytes, bool is_locked) noexcept;

}  // namespace lbea
