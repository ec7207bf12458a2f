// The records of an MCAP file as plain structs, read from bytes and written to bytes. RECORDING.md says which are used.
//
// Parsed records refer (as Bytes) to the bytes that they were parsed from. Times are in ns, log_time on the recording
// machine's clock.
#pragma once

#include "adapters/mcap/bytes.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <optional>

namespace lbea::mcap {
inline constexpr std::array<std::uint8_t, 8> magic{0x89, 'M', 'C', 'A', 'P', '0', '\r', '\n'};
inline constexpr std::size_t record_prefix_bytes = 9;  // opcode u8, length of the content u64

enum class Opcode : std::uint8_t {
  header = 0x01,
  footer = 0x02,
  schema = 0x03,
  channel = 0x04,
  message = 0x05,
  chunk = 0x06,
  message_index = 0x07,
  chunk_index = 0x08,
  attachment = 0x09,
  attachment_index = 0x0a,
  statistics = 0x0b,
  metadata = 0x0c,
  metadata_index = 0x0d,
  summary_offset = 0x0e,
  data_end = 0x0f,
};

using Texts = std::map<std::string, std::string>;

struct Header {
  static constexpr Opcode opcode = Opcode::header;
  std::string profile, library;
};

struct Footer {
  static constexpr Opcode opcode = Opcode::footer;
  std::uint64_t summary_start = 0, summary_offset_start = 0;  // 0: absent
  std::uint32_t summary_crc = 0;                              // 0: not computed
};

struct Schema {
  static constexpr Opcode opcode = Opcode::schema;
  std::uint16_t id = 0;  // not 0
  std::string name, encoding;
  Buffer data;
  friend bool operator==(const Schema&, const Schema&) = default;
};

struct Channel {
  static constexpr Opcode opcode = Opcode::channel;
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  // 0: no schema
  std::string topic, message_encoding;
  Texts metadata;
  friend bool operator==(const Channel&, const Channel&) = default;
};

struct Message {
  static constexpr Opcode opcode = Opcode::message;
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;
  Bytes data;
};
inline constexpr std::size_t message_header_bytes = 22;

struct Chunk {
  static constexpr Opcode opcode = Opcode::chunk;
  std::uint64_t start_time = 0, end_time = 0;  // of its messages; 0 without messages
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  // 0: not computed
  std::string compression;
  Bytes records;
};

struct MessageIndex {
  static constexpr Opcode opcode = Opcode::message_index;
  struct Entry {
    std::uint64_t log_time = 0;
    std::uint64_t offset = 0;  // in the chunk's uncompressed records
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::uint16_t channel_id = 0;
  std::vector<Entry> entries;
};

struct ChunkIndex {
  static constexpr Opcode opcode = Opcode::chunk_index;
  std::uint64_t start_time = 0, end_time = 0;
  std::uint64_t chunk_start = 0, chunk_length = 0;               // the record, prefix included
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;  // offset in the file, by channel
  std::uint64_t message_index_length = 0;                        // total
  std::string compression;
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
  friend bool operator==(const ChunkIndex&, const ChunkIndex&) = default;
};

struct Attachment {
  static constexpr Opcode opcode = Opcode::attachment;
  std::uint64_t log_time = 0, create_time = 0;
  std::string name, media_type;
  Bytes data;
  std::uint32_t crc = 0;  // of the fields above; 0: not computed
};

struct AttachmentIndex {
  static constexpr Opcode opcode = Opcode::attachment_index;
  std::uint64_t offset = 0, length = 0;  // the record, prefix included
  std::uint64_t log_time = 0, create_time = 0, data_size = 0;
  std::string name, media_type;
  friend bool operator==(const AttachmentIndex&, const AttachmentIndex&) = default;
};

struct Statistics {
  static constexpr Opcode opcode = Opcode::statistics;
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;
  std::uint64_t start_time = 0, end_time = 0;
  std::map<std::uint16_t, std::uint64_t> messages_by_channel;
  friend bool operator==(const Statistics&, const Statistics&) = default;
  /// Counts a message.
  void add(std::uint16_t channel, std::uint64_t log_time) {
    start_time = messages++ == 0 ? log_time : std::min(start_time, log_time);
    end_time = std::max(end_time, log_time);
    ++messages_by_channel[channel];
  }
};

struct Metadata {
  static constexpr Opcode opcode = Opcode::metadata;
  std::string name;
  Texts texts;
};

struct MetadataIndex {
  static constexpr Opcode opcode = Opcode::metadata_index;
  std::uint64_t offset = 0, length = 0;
  std::string name;
  friend bool operator==(const MetadataIndex&, const MetadataIndex&) = default;
};

struct SummaryOffset {
  static constexpr Opcode opcode = Opcode::summary_offset;
  Opcode group{};
  std::uint64_t group_start = 0, group_length = 0;
};

struct DataEnd {
  static constexpr Opcode opcode = Opcode::data_end;
  std::uint32_t data_section_crc = 0;  // 0: not computed
};

/// The entry of a chunk whose record is at `start` and `length` bytes long, without its message indexes.
[[nodiscard]] ChunkIndex index_entry(const Chunk& chunk, std::uint64_t start, std::uint64_t length);

/// Reads the content of a record, without its prefix. Nothing when it is too short or contradicts itself; surplus bytes
/// at its end are ignored.
template <class RecordType>
[[nodiscard]] std::optional<RecordType> parse(Bytes content);

/// Appends the whole record, prefix included. Not for Chunk: see append_chunk_head().
template <class RecordType>
void append(Buffer& out, const RecordType& record);
/// Appends the record without its `records`, which are `records_bytes` long and are written by the caller;
/// chunk.records is not used.
void append_chunk_head(Buffer& out, const Chunk& chunk, std::uint64_t records_bytes);
/// Prefix and header of a message whose `data_bytes` bytes of data follow; message.data is not used.
std::array<std::byte, record_prefix_bytes + message_header_bytes> message_head(const Message& message,
                                                                               std::uint64_t data_bytes) noexcept;
}  // namespace lbea::mcap
