// The records of an MCAP file as plain structs, from bytes and to bytes. RECORDING.md says what we use of them.
//
// Views (Bytes) in what is parsed are valid as long as the bytes parsed from. Times are ns, log_time on this
// machine's clock.
#pragma once

#include "adapters/mcap/byte_cursor.hpp"

#include <array>
#include <map>
#include <optional>
#include <string>
#include <vector>

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

using Buffer = std::vector<std::byte>;
using Texts = std::map<std::string, std::string>;

struct Header {
  std::string profile, library;
};

struct Footer {
  std::uint64_t summary_start = 0, summary_offset_start = 0;  // 0: there is none
  std::uint32_t summary_crc = 0;                              // 0: not computed
};

struct Schema {
  std::uint16_t id = 0;  // not 0
  std::string name, encoding;
  Buffer data;
  friend bool operator==(const Schema&, const Schema&) = default;
};

struct Channel {
  std::uint16_t id = 0;
  std::uint16_t schema_id = 0;  // 0: none
  std::string topic, message_encoding;
  Texts metadata;
  friend bool operator==(const Channel&, const Channel&) = default;
};

struct Message {
  std::uint16_t channel_id = 0;
  std::uint32_t sequence = 0;
  std::uint64_t log_time = 0, publish_time = 0;
  Bytes data;
};
inline constexpr std::size_t message_header_bytes = 22;

struct Chunk {
  std::uint64_t start_time = 0, end_time = 0;  // of its messages; 0 when it has none
  std::uint64_t uncompressed_size = 0;
  std::uint32_t uncompressed_crc = 0;  // 0: not computed
  std::string compression;
  Bytes records;
};

struct MessageIndex {
  struct Entry {
    std::uint64_t log_time = 0;
    std::uint64_t offset = 0;  // in the chunk's uncompressed records
    friend bool operator==(const Entry&, const Entry&) = default;
  };
  std::uint16_t channel_id = 0;
  std::vector<Entry> entries;
};

struct ChunkIndex {
  std::uint64_t start_time = 0, end_time = 0;
  std::uint64_t chunk_start = 0, chunk_length = 0;               // the record, prefix included
  std::map<std::uint16_t, std::uint64_t> message_index_offsets;  // by channel, in the file
  std::uint64_t message_index_length = 0;                        // of all of them together
  std::string compression;
  std::uint64_t compressed_size = 0, uncompressed_size = 0;
};

struct Attachment {
  std::uint64_t log_time = 0, create_time = 0;
  std::string name, media_type;
  Bytes data;
  std::uint32_t crc = 0;  // of the fields before it; 0: not computed
};

struct AttachmentIndex {
  std::uint64_t offset = 0, length = 0;  // the record, prefix included
  std::uint64_t log_time = 0, create_time = 0, data_size = 0;
  std::string name, media_type;
};

struct Statistics {
  std::uint64_t messages = 0;
  std::uint16_t schemas = 0;
  std::uint32_t channels = 0, attachments = 0, metadata = 0, chunks = 0;
  std::uint64_t start_time = 0, end_time = 0;
  std::map<std::uint16_t, std::uint64_t> messages_by_channel;
};

struct Metadata {
  std::string name;
  Texts texts;
};

struct MetadataIndex {
  std::uint64_t offset = 0, length = 0;
  std::string name;
};

struct SummaryOffset {
  Opcode group{};
  std::uint64_t group_start = 0, group_length = 0;
};

struct DataEnd {
  std::uint32_t data_section_crc = 0;  // 0: not computed
};

/// The content of a record, without its prefix. Nothing when it is too short or contradicts itself; surplus
/// bytes at its end are ignored.
template <class RecordType>
[[nodiscard]] std::optional<RecordType> parse(Bytes content);

/// Appends the whole record, prefix included.
void append(Buffer& out, const Header& record);
void append(Buffer& out, const Footer& record);
void append(Buffer& out, const Schema& record);
void append(Buffer& out, const Channel& record);
void append(Buffer& out, const Message& record);
void append(Buffer& out, const MessageIndex& record);
void append(Buffer& out, const ChunkIndex& record);
void append(Buffer& out, const Attachment& record);
void append(Buffer& out, const AttachmentIndex& record);
void append(Buffer& out, const Statistics& record);
void append(Buffer& out, const Metadata& record);
void append(Buffer& out, const MetadataIndex& record);
void append(Buffer& out, const SummaryOffset& record);
void append(Buffer& out, const DataEnd& record);
/// The record up to its `records`, which are `records_bytes` long and follow elsewhere; chunk.records is not read.
void append_chunk_head(Buffer& out, const Chunk& chunk, std::uint64_t records_bytes);
/// Prefix and header of a message whose `data_bytes` follow; message.data is not read.
std::array<std::byte, record_prefix_bytes + message_header_bytes> message_head(const Message& message,
                                                                               std::uint64_t data_bytes) noexcept;

}  // namespace lbea::mcap
