// A file mapped read-only, and control over which parts of it are in memory.
#pragma once

#ifdef _WIN32
#include "runtime/src/model/windows_file.hpp"
#else
#include "runtime/src/model/descriptor.hpp"
#endif

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <span>
#include <string>

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
  /// Replaces the pages of a part, in place, by a copy in memory, which changes of the file do not reach. Throws
  /// Error{bad_config | corrupt_model} when there is no memory, or the file cannot be read again.
  void hold(std::span<const std::byte> part) const;
  /// Whether the file was written to or truncated since it was opened. Renaming another file to its name does not
  /// count.
  [[nodiscard]] bool was_written() const noexcept;

 private:
#ifdef _WIN32
  using OpenFile = WindowsFile;
#else
  using OpenFile = Descriptor;
#endif
  struct Version {
    std::int64_t bytes = -1, seconds = 0, nanoseconds = 0;
    friend bool operator==(const Version&, const Version&) = default;
  };
  [[nodiscard]] Version version() const noexcept;

  std::filesystem::path file_;
  OpenFile open_;
  Version opened_;
  std::span<const std::byte> bytes_;
};

/// In UTF-8.
[[nodiscard]] std::string name_of(const std::filesystem::path& file);

/// Releases the memory of a part of a mapping. Later reads load it from the file again.
void release_pages(std::span<const std::byte> bytes) noexcept;
/// Loads a part of a mapping into memory.
void load_pages(std::span<const std::byte> bytes) noexcept;
/// Locks or unlocks a part of a mapping in memory. False, with errno, when the system refuses.
bool lock_pages(std::span<const std::byte> bytes, bool is_locked) noexcept;
/// Bytes of memory that the machine has.
[[nodiscard]] std::uint64_t memory_of_machine() noexcept;
}  // namespace lbea
