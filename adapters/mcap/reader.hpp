// Reads the records of a file or of a chunk one after another.
#pragma once

#include "adapters/mcap/records.hpp"

namespace lbea::mcap {
struct Record {
  Opcode opcode{};
  std::uint64_t offset = 0;  // of its prefix
  std::uint64_t length = 0;  // of its content
  Bytes content;
  [[nodiscard]] std::uint64_t end() const noexcept { return offset + record_prefix_bytes + length; }
};

/// The records of a file. Reads one record at a time into one buffer.
class FileReader {
 public:
  /// Reads from `begin` to `end` <= source.size(). The source must outlive the reader.
  FileReader(const ByteSource& source, std::uint64_t begin, std::uint64_t end)
      : source_(source), position_(begin), end_(end) {}
  /// The next whole record, valid until the next call. Nothing at the end and where no whole record follows; then
  /// position() does not change.
  [[nodiscard]] std::optional<Record> next();
  /// The next record with only the first `most` bytes of its content. position() does not change.
  [[nodiscard]] std::optional<Record> peek(std::size_t most);
  [[nodiscard]] std::uint64_t position() const noexcept { return position_; }
  void go_to(std::uint64_t position) noexcept { position_ = position; }

 private:
  const ByteSource& source_;
  std::uint64_t position_, end_;
  Buffer buffer_;
};

/// The record at the front of `rest`, or nothing when no whole record is there. Removes it from `rest`; `offset` is the
/// offset of `rest` and is advanced with it.
[[nodiscard]] std::optional<Record> next_record(Bytes& rest, std::uint64_t& offset);

/// What may be wrong with a chunk.
enum class ChunkDamage { none, bad_record, unknown_compression, bad_compression, wrong_crc, bad_contents, too_large };
[[nodiscard]] std::string_view to_string(ChunkDamage damage) noexcept;

/// A decompressed chunk whose size and CRC have been checked.
class OpenChunk {
 public:
  /// All chunks of the file together may decompress to about 1,000 times its size. Point clouds stay below ten times.
  explicit OpenChunk(std::uint64_t file_bytes) : budget_((std::uint64_t{64} << 20) + 1'000 * file_bytes) {}
  /// `content`: that of a chunk record. It must stay valid while the records are used.
  [[nodiscard]] ChunkDamage open(Bytes content);
  [[nodiscard]] Bytes records() const noexcept { return records_; }
  [[nodiscard]] const Chunk& chunk() const noexcept { return chunk_; }

 private:
  std::uint64_t budget_;
  Chunk chunk_;
  Buffer decompressed_;
  Bytes records_;
};

/// The schemas and channels that were defined.
struct Definitions {
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  /// Adds a schema or channel record; ignores other records. False when it is damaged or differs from the definition
  /// with the same id.
  [[nodiscard]] bool add(const Record& record);
};

/// Whether `records` are whole records to the last byte and every message in them can be parsed.
[[nodiscard]] bool are_whole(Bytes records);
}  // namespace lbea::mcap
