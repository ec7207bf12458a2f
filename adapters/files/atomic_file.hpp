// Files: written atomically, read at any place or at once.
#pragma once

#include "runtime/src/model/descriptor.hpp"

#include <cstdint>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::io {
/// A file that appears under its name only when it is complete. Bytes go to a temporary file in the same folder;
/// commit() flushes it to the disk and renames it. Without commit() the destructor removes it, and an earlier file of
/// that name stays as it was.
class AtomicFile {
 public:
  /// Throws Error{write_failed} when the file cannot be created.
  explicit AtomicFile(std::filesystem::path path);
  ~AtomicFile();
  AtomicFile(const AtomicFile&) = delete;
  AtomicFile& operator=(const AtomicFile&) = delete;

  /// Appends. Throws Error{write_failed} with file, byte and the system's reason; after that only the destructor may be
  /// called.
  void write(std::span<const std::byte> bytes);
  void write(std::string_view text) { write(std::as_bytes(std::span(text))); }
  /// Throws Error{write_failed}; the new file then does not exist under its name.
  void commit();

  /// Bytes appended so far.
  [[nodiscard]] std::uint64_t size() const noexcept { return written_ + buffer_.size(); }
  [[nodiscard]] const std::filesystem::path& path() const noexcept { return path_; }

 private:
  void flush();
  void write_through(std::span<const std::byte> bytes);
  void close_descriptor();
  void sync_folder() const;
  [[noreturn]] void fail(const std::string& action, int error) const;

  std::filesystem::path path_;
  std::filesystem::path temporary_;  // empty once renamed
  int descriptor_ = -1;
  std::uint64_t written_ = 0;  // passed to the system
  std::vector<std::byte> buffer_;
};

/// Writes this text as an AtomicFile. Throws Error{write_failed}.
void write_file(const std::filesystem::path& path, std::string_view text);

/// A regular file, read at any place.
class InputFile {
 public:
  /// Throws Error{file_not_found} when it is absent, Error{bad_input} when it cannot be read.
  explicit InputFile(const std::filesystem::path& path);
  [[nodiscard]] const std::string& name() const noexcept { return name_; }
  [[nodiscard]] int descriptor() const noexcept { return file_.value(); }
  [[nodiscard]] std::uint64_t size() const noexcept { return size_; }  // when it was opened
  /// Fills `into`; the range must lie within size(). Throws Error{bad_input}.
  void read(std::uint64_t offset, std::span<std::byte> into) const;

 private:
  [[noreturn]] void fail(std::uint64_t byte, const std::string& why) const;
  std::string name_;
  Descriptor file_;
  std::uint64_t size_ = 0;
};

/// The whole of a file, as InputFile.
[[nodiscard]] std::vector<std::byte> read_file(const std::filesystem::path& path);

/// The same bytes as characters.
[[nodiscard]] inline std::string_view as_text(std::span<const std::byte> bytes) noexcept {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}
}  // namespace lbea::io
