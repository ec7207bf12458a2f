// Files by the calls of the operating system: one implementation per system. Functions that return int return 0 or an
// error number (errno).
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <span>

namespace lbea::io::system {
/// The descriptor of a new file, for writing; -1 with errno, EEXIST when there is one of that name.
[[nodiscard]] int create_file(const std::filesystem::path& file) noexcept;
/// The descriptor of a file, for reading; -1 with errno. Never waits, as for a FIFO.
[[nodiscard]] int open_file(const std::filesystem::path& file) noexcept;

struct FileFacts {
  bool is_regular = false;
  std::uint64_t bytes = 0;
};
/// Nothing with errno on failure.
[[nodiscard]] std::optional<FileFacts> facts_of(int descriptor) noexcept;

/// The number of bytes written or read, perhaps not all; -1 with errno.
[[nodiscard]] std::int64_t write_some(int descriptor, std::span<const std::byte> bytes) noexcept;
[[nodiscard]] std::int64_t read_some(int descriptor, std::uint64_t offset, std::span<std::byte> into) noexcept;
/// The file will be read from front to end.
void expect_sequential(int descriptor) noexcept;

/// Waits until what was written is on the disk.
[[nodiscard]] int flush(int descriptor) noexcept;
/// Waits until the names in a folder are on the disk. 0 when the folder cannot be opened.
[[nodiscard]] int flush_folder(const std::filesystem::path& folder) noexcept;
/// Renames a file; another one of the new name is replaced in one step.
[[nodiscard]] int replace_file(const std::filesystem::path& from, const std::filesystem::path& to) noexcept;
void remove_file(const std::filesystem::path& file) noexcept;
/// A new folder in `parent`, to which others have no access where the system can say so; empty with errno on failure.
[[nodiscard]] std::filesystem::path create_temporary_folder(const std::filesystem::path& parent);
[[nodiscard]] int process_id() noexcept;
}  // namespace lbea::io::system
