// The records of a file or of a chunk, one after another.
#pragma once

#include "adapters/mcap/byte_source.hpp"
#include "adapters/mcap/mcap_records.hpp"

namespace lbea::mcap {

struct Record {
  Opcode opcode{};
  std::uint64_t offset = 0;  // of its prefix
  std::uint64_t length = 0;  // of its content
  Bytes content;
  [[nodiscard]] std::uint64_t end() const noexcept { return offset + record_prefix_bytes + length; }
};

/// Through a file. Reads one record at a time into one buffer.
class FileWalk {
 public:
  /// From `begin` to `end` <= source.size(); the source outlives the walk.
  FileWalk(const ByteSource& source, std::uint64_t begin, std::uint64_t end)
      : source_(source), position_(begin), end_(end) {}
  /// The next whole record, valid until the next call; nothing at the end, and where what follows is none. Then
  /// position() stays there.
  [[nodiscard]] std::optional<Record> next();
  /// The same without the content, which is passed over: only its first `most` bytes are there.
  [[nodiscard]] std::optional<Record> peek(std::size_t most);
  /// Passes over the record that peek() showed.
  void skip();
  [[nodiscard]] std::uint64_t position() const noexcept { return position_; }
  void go_to(std::uint64_t position) noexcept { position_ = position; }

 private:
  struct Prefix {
    Opcode opcode{};
    std::uint64_t length = 0;
  };
  [[nodiscard]] std::optional<Prefix> prefix() const;
  const ByteSource& source_;
  std::uint64_t position_, end_;
  Buffer buffer_;
};

/// The record at the front of `rest`, which is moved behind it; nothing when none is there as a whole. `offset`
/// is that of `rest` and moves along.
[[nodiscard]] std::optional<Record> next_record(Bytes& rest, std::uint64_t& offset);

/// What may be wrong with a chunk.
enum class ChunkDamage : std::uint8_t {
  none,
  bad_record,
  unknown_compression,
  bad_compression,
  wrong_crc,
  bad_contents
};
[[nodiscard]] std::string_view to_string(ChunkDamage damage) noexcept;

/// A chunk with its records ready to be read, after its size and CRC have been checked.
class OpenChunk {
 public:
  /// The content of a chunk record; it stays alive as long as the records are used.
  [[nodiscard]] ChunkDamage open(Bytes content);
  [[nodiscard]] Bytes records() const noexcept { return records_; }
  [[nodiscard]] const Chunk& chunk() const noexcept { return chunk_; }

 private:
  Chunk chunk_;
  Buffer decompressed_;
  Bytes records_;
};

/// What is needed to make sense of messages: the schemas and channels that were declared.
struct Definitions {
  std::map<std::uint16_t, Schema> schemas;
  std::map<std::uint16_t, Channel> channels;
  /// Takes in a schema or channel record; other records are nothing to it. False when it is damaged, or differs
  /// from what stood under the same id.
  [[nodiscard]] bool take(const Record& record);
};

/// Whether `records` are whole records to the last byte and every message in them can be parsed.
[[nodiscard]] bool are_whole(Bytes records);

}  // namespace lbea::mcap
