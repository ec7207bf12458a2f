// Writes the bytes of a recording. Tests replace it with disks that fail.
#pragma once

#include "adapters/mcap/bytes.hpp"

#include <limits>

namespace lbea::mcap {
/// Functions return 0 or the system's error number. One thread at a time, except sync().
class Sink {
 public:
  virtual ~Sink() = default;
  /// Appends all of `pieces` or, on failure, nothing.
  [[nodiscard]] virtual int append(std::span<const Bytes> pieces) noexcept = 0;
  /// Waits until all appended bytes are on the disk. Any thread.
  [[nodiscard]] virtual int sync() noexcept = 0;
  /// Forces everything to the disk and gives the file its final name.
  [[nodiscard]] virtual int commit() noexcept = 0;
  /// Bytes that may still be appended, as far as is known.
  [[nodiscard]] virtual std::uint64_t free_bytes() const noexcept { return std::numeric_limits<std::uint64_t>::max(); }
  /// Whether the destructor keeps the appended bytes without a successful commit(). The default is no.
  virtual void keep(bool wanted) noexcept { static_cast<void>(wanted); }
};

/// FILE with ".partial" appended.
[[nodiscard]] inline std::filesystem::path partial_name(std::filesystem::path file) { return file += ".partial"; }

/// A file that is named FILE.partial until commit(). When the program is killed, FILE.partial remains for
/// `lbea-inspect --recover`. If somebody removes that name meanwhile, commit() copies the bytes. When the object is
/// destroyed without commit(), it remains only after keep(true).
class PartialFile final : public Sink {
 public:
  /// Throws Error{write_failed} when FILE or FILE.partial exists: recordings are never overwritten.
  explicit PartialFile(const std::filesystem::path& file) : PartialFile(file, partial_name(file)) {}
  /// The same with another name until commit(), for the case that FILE is made from FILE.partial.
  PartialFile(const std::filesystem::path& file, const std::filesystem::path& partial);
  ~PartialFile() override;
  PartialFile(const PartialFile&) = delete;
  PartialFile& operator=(const PartialFile&) = delete;
  [[nodiscard]] int append(std::span<const Bytes> pieces) noexcept override;
  [[nodiscard]] int sync() noexcept override;
  [[nodiscard]] int commit() noexcept override;
  [[nodiscard]] std::uint64_t free_bytes() const noexcept override;
  void keep(bool wanted) noexcept override { kept_ = wanted; }

 private:
  void cut_back() noexcept;
  [[nodiscard]] bool is_named() const noexcept;
  [[nodiscard]] int copy_to_final_name() const noexcept;
  [[nodiscard]] int give_final_name() const noexcept;
  void start_write_back() noexcept;
  std::filesystem::path file_, partial_, folder_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0, started_ = 0;  // bytes appended; bytes for which write-back was started
  bool kept_ = false, committed_ = false;
  int broken_ = 0;  // the error of a failed append that could not be undone
};
}  // namespace lbea::mcap
