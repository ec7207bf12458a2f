// A file of a bake's work folder: there whole and right, or not at all, whenever its writer dies.
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <vector>

namespace lbea {

enum class WorkKind : std::uint32_t { survey = 1, basis, plan, record, footprint, failure };

/// What a work file is: its kind, and the hash of all that its content depends on.
struct WorkName {
  WorkKind kind{};
  std::uint64_t key = 0;
};

/// Some bytes at the front, and an XXH3-64 of the content behind it. Written under a temporary name in the same folder,
/// renamed by commit(). Failures are Error{write_failed} that name the file.
class WorkWriter {
 public:
  /// is_durable: commit() waits for the disk, so that a machine that loses its power loses no finished file.
  WorkWriter(std::filesystem::path file, WorkName name, bool is_durable);
  ~WorkWriter();
  WorkWriter(const WorkWriter&) = delete;
  WorkWriter& operator=(const WorkWriter&) = delete;

  void bytes(std::span<const std::byte> bytes);
  void commit();

 private:
  void flush();
  [[noreturn]] void fail(const char* action, int error) const;

  struct Hash;
  std::filesystem::path file_, temporary_;  // temporary_ is empty once renamed
  WorkName name_;
  bool is_durable_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;  // of the content
  std::vector<std::byte> buffer_;
  std::unique_ptr<Hash> hash_;
};

/// Reads from front to end through a buffer. Throws Error{bad_input} naming the file and what to do.
class WorkReader {
 public:
  WorkReader(std::filesystem::path file, WorkName name);
  ~WorkReader();
  WorkReader(const WorkReader&) = delete;
  WorkReader& operator=(const WorkReader&) = delete;

  void bytes(std::span<std::byte> bytes);
  /// Bytes of content not yet read.
  [[nodiscard]] std::uint64_t rest() const noexcept { return rest_; }
  /// All of it was read, and its checksum holds.
  void finish();
  [[noreturn]] void fail(const char* what) const;

 private:
  void read(std::span<std::byte> bytes);

  struct Hash;
  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t rest_ = 0;
  std::vector<std::byte> buffer_;
  std::size_t next_ = 0, filled_ = 0;  // of the buffer
  std::unique_ptr<Hash> hash_;
};

/// Whether the file stands under its final name, of this kind and key and of the size it says. Its bytes are not read.
[[nodiscard]] bool is_finished(const std::filesystem::path& file, WorkName name);

}  // namespace lbea
