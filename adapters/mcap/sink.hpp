// Where the bytes of a recording go. Tests put failing disks here.
#pragma once

#include "adapters/mcap/byte_cursor.hpp"

#include <filesystem>

namespace lbea::mcap {

/// Results are 0 or the system's error number. One thread at a time, except sync().
class Sink {
 public:
  virtual ~Sink() = default;
  /// Appends all of `pieces` or, on failure, nothing: what was there before ends where it ended.
  [[nodiscard]] virtual int append(std::span<const Bytes> pieces) noexcept = 0;
  /// Waits until all that was appended is on the disk. Any thread.
  [[nodiscard]] virtual int sync() noexcept = 0;
  /// All is written: to the disk with it, and under its name.
  [[nodiscard]] virtual int commit() noexcept = 0;
  /// Whether what was appended is to outlive this object when commit() never succeeds. At first it is not.
  virtual void keep(bool wanted) noexcept { static_cast<void>(wanted); }
};

/// FILE with ".partial" behind it.
[[nodiscard]] std::filesystem::path partial_name(const std::filesystem::path& file);

/// A file that is called FILE.partial until commit(). When the program dies, what was appended stays there, for
/// `lbea-inspect --recover`; when it goes on without commit(), only what it wants to keep.
class PartialFile final : public Sink {
 public:
  /// Throws Error{write_failed} when FILE or FILE.partial exists: recordings are never overwritten.
  explicit PartialFile(const std::filesystem::path& file) : PartialFile(file, partial_name(file)) {}
  /// The same under another name until commit(): FILE.partial may be what FILE is made of.
  PartialFile(const std::filesystem::path& file, const std::filesystem::path& partial);
  ~PartialFile() override;
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  [[nodiscard]] int append(std::span<const Bytes> pieces) noexcept override;
  [[nodiscard]] int sync() noexcept override;
  [[nodiscard]] int commit() noexcept override;
  void keep(bool wanted) noexcept override { kept_ = wanted; }

 private:
  void cut_back() noexcept;
  void start_write_back() noexcept;
  std::filesystem::path file_, partial_, folder_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0, started_ = 0;  // appended whole; of which the system was told to write
  bool kept_ = false, committed_ = false;
  int broken_ = 0;  // a failed append could not be undone: this error for ever
};

}  // namespace lbea::mcap
