// Where the bytes of a recording are read from: a file, or memory.
#pragma once

#include "adapters/mcap/byte_cursor.hpp"

#include <filesystem>
#include <string>

namespace lbea::mcap {

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  /// Fills `into` from `offset` on, which with its length lies within size(). Throws Error{bad_input} when the
  /// system cannot.
  virtual void read(std::uint64_t offset, std::span<std::byte> into) const = 0;
  /// For sentences.
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
};

class MemorySource final : public ByteSource {
 public:
  /// `bytes` outlive the source.
  explicit MemorySource(Bytes bytes, std::string name = "memory") : bytes_(bytes), name_(std::move(name)) {}
  [[nodiscard]] std::uint64_t size() const noexcept override { return bytes_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> into) const override;
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }

 private:
  Bytes bytes_;
  std::string name_;
};

class FileSource final : public ByteSource {
 public:
  /// Throws Error{file_not_found | bad_input}. The size is that at opening.
  explicit FileSource(const std::filesystem::path& path);
  ~FileSource() override;
  FileSource(const FileSource&) = delete;
  FileSource& operator=(const FileSource&) = delete;
  [[nodiscard]] std::uint64_t size() const noexcept override { return size_; }
  void read(std::uint64_t offset, std::span<std::byte> into) const override;
  [[nodiscard]] const std::string& name() const noexcept override { return name_; }

 private:
  std::string name_;
  int descriptor_ = -1;
  std::uint64_t size_ = 0;
};

}  // namespace lbea::mcap
