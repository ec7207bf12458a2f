// The bytes of a recording: where they are read from, a cursor that never reads past their end, their CRC-32, and the
// compressions of chunks: LZ4 frames and Zstandard.
#pragma once

#include "adapters/files/atomic_file.hpp"

#include <bit>
#include <cstring>
#include <optional>

namespace lbea::mcap {
using Bytes = std::span<const std::byte>;
using Buffer = std::vector<std::byte>;

[[nodiscard]] inline std::size_t total_size(std::span<const Bytes> pieces) noexcept {
  std::size_t sum = 0;
  for (const Bytes piece : pieces) sum += piece.size();
  return sum;
}

static_assert(std::endian::native == std::endian::little, "numbers are copied in the file's byte order");

/// Reads little-endian numbers, texts and blocks in order. A read past the end fails: from then on everything is zero
/// or empty and intact() is false.
class ByteCursor {
 public:
  explicit ByteCursor(Bytes rest) : rest_(rest) {}

  template <class Number>
  Number number() {
    Number value{};
    const Bytes bytes = block(sizeof value);
    if (!bytes.empty()) std::memcpy(&value, bytes.data(), sizeof value);
    return value;
  }
  Bytes block(std::uint64_t length) {
    if (length > rest_.size()) {
      intact_ = false;
      rest_ = {};
      return {};
    }
    const Bytes bytes = rest_.first(static_cast<std::size_t>(length));
    rest_ = rest_.subspan(bytes.size());
    return bytes;
  }
  /// Preceded by its length as u32.
  Bytes short_block() { return block(number<std::uint32_t>()); }
  /// Preceded by its length as u64.
  Bytes long_block() { return block(number<std::uint64_t>()); }
  std::string_view text() {
    const Bytes bytes = short_block();
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
  }

  [[nodiscard]] bool intact() const { return intact_; }
  [[nodiscard]] bool at_end() const { return rest_.empty(); }
  void fail() { intact_ = false; }

 private:
  Bytes rest_;
  bool intact_ = true;
};

/// CRC-32 as in zlib and MCAP. `before`: the checksum of the bytes that precede `bytes`.
[[nodiscard]] std::uint32_t crc32(Bytes bytes, std::uint32_t before = 0) noexcept;
/// The checksum of two consecutive pieces from the checksum of each.
[[nodiscard]] std::uint32_t crc32_joined(std::uint32_t first, std::uint32_t second,
                                         std::uint64_t second_bytes) noexcept;

class ByteSource {
 public:
  virtual ~ByteSource() = default;
  [[nodiscard]] virtual std::uint64_t size() const noexcept = 0;
  /// Fills `into` from `offset` on; the range must lie within size(). Throws Error{bad_input} when the system cannot
  /// read it.
  virtual void read(std::uint64_t offset, std::span<std::byte> into) const = 0;
  /// For error messages.
  [[nodiscard]] virtual const std::string& name() const noexcept = 0;
};

class MemorySource final : public ByteSource {
 public:
  /// `bytes` must outlive the source.
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
  /// Throws Error{file_not_found | bad_input}. size() is the size at opening.
  explicit FileSource(const std::filesystem::path& path);
  [[nodiscard]] std::uint64_t size() const noexcept override { return file_.size(); }
  void read(std::uint64_t offset, std::span<std::byte> into) const override { file_.read(offset, into); }
  [[nodiscard]] const std::string& name() const noexcept override { return file_.name(); }

 private:
  io::InputFile file_;
};

enum class Compression : std::uint8_t { none, lz4, zstd };

/// The name in the file: "", "lz4" or "zstd".
[[nodiscard]] std::string_view name_of(Compression compression) noexcept;
/// Nothing for any other name.
[[nodiscard]] std::optional<Compression> compression_named(std::string_view name) noexcept;

/// Appends the compressed concatenation of `pieces`. Not for Compression::none. False when the library fails.
[[nodiscard]] bool compress(Compression compression, std::span<const Bytes> pieces, Buffer& out);

/// Replaces `out` with the decompressed `bytes`. False unless they are intact and decompress to exactly `size` bytes.
/// Memory is allocated as output is produced, because `size` is not trusted.
[[nodiscard]] bool decompress(Compression compression, Bytes bytes, std::uint64_t size, Buffer& out);
}  // namespace lbea::mcap
