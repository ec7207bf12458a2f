// A file of a bake's work folder: complete or absent, even when its writer is killed.
#pragma once

#include "runtime/src/model/checksum.hpp"

#include <lbea/lbea.hpp>

#include <optional>

namespace lbea::bake {
enum class WorkKind : std::uint32_t { survey = 1, basis, plan, record, grid_and_images, failure };

/// Identity of a work file: its kind, and the hash of everything that its content depends on.
struct WorkName {
  WorkKind kind{};
  std::uint64_t key = 0;
};

/// Writes header, content and the content's XXH3-64 under a temporary name in the same folder; commit() renames the
/// file. Throws Error{write_failed} naming the file.
class WorkWriter {
 public:
  /// is_durable: commit() waits for the disk, so that no finished file is lost in a power failure.
  WorkWriter(std::filesystem::path file, WorkName name, bool is_durable);
  ~WorkWriter();
  WorkWriter(const WorkWriter&) = delete;
  WorkWriter& operator=(const WorkWriter&) = delete;

  void bytes(std::span<const std::byte> bytes);
  void commit();

 private:
  void flush();
  [[noreturn]] void fail(const char* action, int error) const;

  std::filesystem::path file_, temporary_;  // temporary_ is empty once renamed
  WorkName name_;
  bool is_durable_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;  // of the content
  std::vector<std::byte> buffer_;
  RunningChecksum checksum_;
};

/// A finished file whose bytes are not those that were written; it must be removed and made again.
struct DamagedWorkFile : Error {
  DamagedWorkFile(std::filesystem::path path, const std::string& sentence)
      : Error(Status::bad_input, sentence), file(std::move(path)) {}
  std::filesystem::path file;
};

/// Name of a file until it is finished: FINAL.tmp-PROCESS-NUMBER@HOST.
struct TemporaryName {
  std::string final_name, host;
  int process = 0;
};
[[nodiscard]] std::optional<TemporaryName> parse_temporary(const std::string& file_name);
/// Name of this machine in temporary names.
[[nodiscard]] const std::string& host_name();

/// Buffered sequential reading. Throws DamagedWorkFile, and Error{bad_input} when the file cannot be read.
class WorkReader {
 public:
  WorkReader(std::filesystem::path file, WorkName name);
  ~WorkReader();
  WorkReader(const WorkReader&) = delete;
  WorkReader& operator=(const WorkReader&) = delete;

  void bytes(std::span<std::byte> bytes);
  /// Bytes of content not yet read.
  [[nodiscard]] std::uint64_t rest() const noexcept { return rest_; }
  /// Checks that the whole content was read and that its checksum is correct.
  void finish();
  [[noreturn]] void fail(const char* what) const;

 private:
  [[noreturn]] void fail_to_read(const char* what) const;
  void read(std::span<std::byte> bytes);

  std::filesystem::path file_;
  int descriptor_ = -1;
  std::uint64_t rest_ = 0;
  std::vector<std::byte> buffer_;
  std::size_t next_ = 0, filled_ = 0;  // of the buffer
  RunningChecksum checksum_;
};

/// Whether the file exists under its final name with this kind, this key and the size in its header. Reads only the
/// header.
[[nodiscard]] bool is_finished(const std::filesystem::path& file, WorkName name);
}  // namespace lbea::bake
