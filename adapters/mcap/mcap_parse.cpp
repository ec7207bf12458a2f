#include "adapters/mcap/mcap_records.hpp"

namespace lbea::mcap {
namespace {

Buffer copy(Bytes bytes) { return {bytes.begin(), bytes.end()}; }

Texts texts(ByteCursor& cursor) {
  Texts result;
  ByteCursor pairs(cursor.short_block());
  while (pairs.intact() && !pairs.at_end()) {
    const std::string_view key = pairs.text();
    result.emplace(key, pairs.text());
  }
  if (!pairs.intact()) cursor.fail();
  return result;
}

std::map<std::uint16_t, std::uint64_t> numbers_by_channel(ByteCursor& cursor) {
  std::map<std::uint16_t, std::uint64_t> result;
  ByteCursor pairs(cursor.short_block());
  while (pairs.intact() && !pairs.at_end()) {
    const auto channel = pairs.number<std::uint16_t>();
    result[channel] = pairs.number<std::uint64_t>();
  }
  if (!pairs.intact()) cursor.fail();
  return result;
}

template <class RecordType>
std::optional<RecordType> if_intact(const ByteCursor& cursor, RecordType& record) {
  if (!cursor.intact()) return std::nullopt;
  return std::move(record);
}

}  // namespace

// Members are filled one statement after another: the order is the file's.

template <>
std::optional<Header> parse(Bytes content) {
  ByteCursor from(content);
  Header record;
  record.profile = from.text();
  record.library = from.text();
  return if_intact(from, record);
}

template <>
std::optional<Footer> parse(Bytes content) {
  ByteCursor from(content);
  Footer record;
  record.summary_start = from.number<std::uint64_t>();
  record.summary_offset_start = from.number<std::uint64_t>();
  record.summary_crc = from.number<std::uint32_t>();
  return if_intact(from, record);
}

template <>
std::optional<Schema> parse(Bytes content) {
  ByteCursor from(content);
  Schema record;
  record.id = from.number<std::uint16_t>();
  record.name = from.text();
  record.encoding = from.text();
  record.data = copy(from.short_block());
  if (record.id == 0) from.fail();
  return if_intact(from, record);
}

template <>
std::optional<Channel> parse(Bytes content) {
  ByteCursor from(content);
  Channel record;
  record.id = from.number<std::uint16_t>();
  record.schema_id = from.number<std::uint16_t>();
  record.topic = from.text();
  record.message_encoding = from.text();
  record.metadata = texts(from);
  return if_intact(from, record);
}

template <>
std::optional<Message> parse(Bytes content) {
  ByteCursor from(content);
  Message record;
  record.channel_id = from.number<std::uint16_t>();
  record.sequence = from.number<std::uint32_t>();
  record.log_time = from.number<std::uint64_t>();
  record.publish_time = from.number<std::uint64_t>();
  if (from.intact()) record.data = content.subspan(message_header_bytes);
  return if_intact(from, record);
}

template <>
std::optional<Chunk> parse(Bytes content) {
  ByteCursor from(content);
  Chunk record;
  record.start_time = from.number<std::uint64_t>();
  record.end_time = from.number<std::uint64_t>();
  record.uncompressed_size = from.number<std::uint64_t>();
  record.uncompressed_crc = from.number<std::uint32_t>();
  record.compression = from.text();
  record.records = from.long_block();
  return if_intact(from, record);
}

template <>
std::optional<MessageIndex> parse(Bytes content) {
  ByteCursor from(content);
  MessageIndex record;
  record.channel_id = from.number<std::uint16_t>();
  const Bytes entries = from.short_block();
  if (entries.size() % (2 * sizeof(std::uint64_t)) != 0) from.fail();
  for (ByteCursor entry(entries); from.intact() && !entry.at_end();) {
    const auto log_time = entry.number<std::uint64_t>();
    record.entries.push_back({log_time, entry.number<std::uint64_t>()});
  }
  return if_intact(from, record);
}

template <>
std::optional<ChunkIndex> parse(Bytes content) {
  ByteCursor from(content);
  ChunkIndex record;
  record.start_time = from.number<std::uint64_t>();
  record.end_time = from.number<std::uint64_t>();
  record.chunk_start = from.number<std::uint64_t>();
  record.chunk_length = from.number<std::uint64_t>();
  record.message_index_offsets = numbers_by_channel(from);
  record.message_index_length = from.number<std::uint64_t>();
  record.compression = from.text();
  record.compressed_size = from.number<std::uint64_t>();
  record.uncompressed_size = from.number<std::uint64_t>();
  return if_intact(from, record);
}

template <>
std::optional<Attachment> parse(Bytes content) {
  ByteCursor from(content);
  Attachment record;
  record.log_time = from.number<std::uint64_t>();
  record.create_time = from.number<std::uint64_t>();
  record.name = from.text();
  record.media_type = from.text();
  record.data = from.long_block();
  record.crc = from.number<std::uint32_t>();
  return if_intact(from, record);
}

template <>
std::optional<AttachmentIndex> parse(Bytes content) {
  ByteCursor from(content);
  AttachmentIndex record;
  record.offset = from.number<std::uint64_t>();
  record.length = from.number<std::uint64_t>();
  record.log_time = from.number<std::uint64_t>();
  record.create_time = from.number<std::uint64_t>();
  record.data_size = from.number<std::uint64_t>();
  record.name = from.text();
  record.media_type = from.text();
  return if_intact(from, record);
}

template <>
std::optional<Statistics> parse(Bytes content) {
  ByteCursor from(content);
  Statistics record;
  record.messages = from.number<std::uint64_t>();
  record.schemas = from.number<std::uint16_t>();
  record.channels = from.number<std::uint32_t>();
  record.attachments = from.number<std::uint32_t>();
  record.metadata = from.number<std::uint32_t>();
  record.chunks = from.number<std::uint32_t>();
  record.start_time = from.number<std::uint64_t>();
  record.end_time = from.number<std::uint64_t>();
  record.messages_by_channel = numbers_by_channel(from);
  return if_intact(from, record);
}

template <>
std::optional<Metadata> parse(Bytes content) {
  ByteCursor from(content);
  Metadata record;
  record.name = from.text();
  record.texts = texts(from);
  return if_intact(from, record);
}

template <>
std::optional<MetadataIndex> parse(Bytes content) {
  ByteCursor from(content);
  MetadataIndex record;
  record.offset = from.number<std::uint64_t>();
  record.length = from.number<std::uint64_t>();
  record.name = from.text();
  return if_intact(from, record);
}

template <>
std::optional<SummaryOffset> parse(Bytes content) {
  ByteCursor from(content);
  SummaryOffset record;
  record.group = static_cast<Opcode>(from.number<std::uint8_t>());
  record.group_start = from.number<std::uint64_t>();
  record.group_length = from.number<std::uint64_t>();
  return if_intact(from, record);
}

template <>
std::optional<DataEnd> parse(Bytes content) {
  ByteCursor from(content);
  DataEnd record;
  record.data_section_crc = from.number<std::uint32_t>();
  return if_intact(from, record);
}

}  // namespace lbea::mcap
