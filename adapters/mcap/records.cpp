#include "adapters/mcap/records.hpp"

#include <type_traits>

namespace lbea::mcap {
namespace {
template <class Type, class RecordType>
concept Is = std::same_as<std::remove_const_t<Type>, RecordType>;
template <class Type>
concept IsNumber = std::is_integral_v<Type> || std::is_enum_v<Type>;

using NumberByChannel = std::map<std::uint16_t, std::uint64_t>;

/// Appends one record; the destructor fills in its length.
class FieldWriter {
 public:
  FieldWriter(Buffer& out, Opcode opcode) : out_(out) {
    write(opcode);
    write(std::uint64_t{0});
    begin_ = out_.size();
  }
  ~FieldWriter() { patch<std::uint64_t>(begin_); }
  FieldWriter(const FieldWriter&) = delete;
  FieldWriter& operator=(const FieldWriter&) = delete;

  template <class... Fields>
  void operator()(const Fields&... fields) {
    (write(fields), ...);
  }

 private:
  template <IsNumber Number>
  void write(const Number& value) {
    append(std::as_bytes(std::span{&value, 1}));
  }
  void write(const std::string& text) { block<std::uint32_t>(std::as_bytes(std::span{text})); }
  void write(const Buffer& data) { block<std::uint32_t>(data); }
  void write(const Bytes& data) { block<std::uint64_t>(data); }
  void write(const MessageIndex::Entry& entry) { (*this)(entry.log_time, entry.offset); }
  template <class First, class Second>
  void write(const std::pair<First, Second>& pair) {
    (*this)(pair.first, pair.second);
  }
  void write(const Texts& texts) { list(texts); }
  void write(const NumberByChannel& numbers) { list(numbers); }
  void write(const std::vector<MessageIndex::Entry>& entries) { list(entries); }
  void append(Bytes data) { out_.insert(out_.end(), data.begin(), data.end()); }
  template <class Length>
  void block(Bytes data) {
    write(static_cast<Length>(data.size()));
    append(data);
  }
  /// The items, preceded by their size in bytes as u32.
  void list(const auto& items) {
    write(std::uint32_t{0});
    const std::size_t begin = out_.size();
    for (const auto& item : items) write(item);
    patch<std::uint32_t>(begin);
  }
  /// Sets the length that stands before `begin`.
  template <class Length>
  void patch(std::size_t begin) {
    const auto length = static_cast<Length>(out_.size() - begin);
    std::memcpy(out_.data() + begin - sizeof length, &length, sizeof length);
  }
  Buffer& out_;
  std::size_t begin_ = 0;
};

class FieldReader {
 public:
  explicit FieldReader(Bytes content) : from_(content) {}

  template <class... Fields>
  void operator()(Fields&... fields) {
    (read(fields), ...);
  }
  [[nodiscard]] bool intact() const { return from_.intact(); }
  void fail() { from_.fail(); }

 private:
  template <IsNumber Number>
  void read(Number& into) {
    into = from_.number<Number>();
  }
  void read(std::string& into) { into = from_.text(); }
  void read(Buffer& into) {
    const Bytes bytes = from_.short_block();
    into.assign(bytes.begin(), bytes.end());
  }
  void read(Bytes& into) { into = from_.long_block(); }
  void read(Texts& into) {
    list([&](ByteCursor& items) {
      const std::string_view key = items.text();
      into.emplace(key, items.text());
    });
  }
  void read(NumberByChannel& into) {
    list([&](ByteCursor& items) {
      const auto channel = items.number<std::uint16_t>();
      into[channel] = items.number<std::uint64_t>();
    });
  }
  void read(std::vector<MessageIndex::Entry>& into) {
    list([&](ByteCursor& items) {
      const auto log_time = items.number<std::uint64_t>();
      into.push_back({log_time, items.number<std::uint64_t>()});
    });
  }
  template <class ReadItem>
  void list(ReadItem read_item) {
    ByteCursor items(from_.short_block());
    while (items.intact() && !items.at_end()) read_item(items);
    if (!items.intact()) from_.fail();
  }
  ByteCursor from_;
};

// The fields of each record in the order of the file, for reading and writing.

void fields(auto& each, Is<Header> auto& record) { each(record.profile, record.library); }

void fields(auto& each, Is<Footer> auto& record) {
  each(record.summary_start, record.summary_offset_start, record.summary_crc);
}

void fields(auto& each, Is<Schema> auto& record) { each(record.id, record.name, record.encoding, record.data); }

void fields(auto& each, Is<Channel> auto& record) {
  each(record.id, record.schema_id, record.topic, record.message_encoding, record.metadata);
}

/// All but the data.
void fields(auto& each, Is<Message> auto& record) {
  each(record.channel_id, record.sequence, record.log_time, record.publish_time);
}

/// All but the records.
void chunk_head(auto& each, Is<Chunk> auto& record) {
  each(record.start_time, record.end_time, record.uncompressed_size, record.uncompressed_crc, record.compression);
}

void fields(auto& each, Is<Chunk> auto& record) {
  chunk_head(each, record);
  each(record.records);
}

void fields(auto& each, Is<MessageIndex> auto& record) { each(record.channel_id, record.entries); }

void fields(auto& each, Is<ChunkIndex> auto& record) {
  each(record.start_time, record.end_time, record.chunk_start, record.chunk_length, record.message_index_offsets,
       record.message_index_length, record.compression, record.compressed_size, record.uncompressed_size);
}

void fields(auto& each, Is<Attachment> auto& record) {
  each(record.log_time, record.create_time, record.name, record.media_type, record.data, record.crc);
}

void fields(auto& each, Is<AttachmentIndex> auto& record) {
  each(record.offset, record.length, record.log_time, record.create_time, record.data_size, record.name,
       record.media_type);
}

void fields(auto& each, Is<Statistics> auto& record) {
  each(record.messages, record.schemas, record.channels, record.attachments, record.metadata, record.chunks,
       record.start_time, record.end_time, record.messages_by_channel);
}

void fields(auto& each, Is<Metadata> auto& record) { each(record.name, record.texts); }
void fields(auto& each, Is<MetadataIndex> auto& record) { each(record.offset, record.length, record.name); }
void fields(auto& each, Is<SummaryOffset> auto& record) { each(record.group, record.group_start, record.group_length); }
void fields(auto& each, Is<DataEnd> auto& record) { each(record.data_section_crc); }
}  // namespace

template <class RecordType>
std::optional<RecordType> parse(Bytes content) {
  FieldReader from(content);
  RecordType record;
  fields(from, record);
  if constexpr (std::same_as<RecordType, Schema>)
    if (record.id == 0) from.fail();
  if (!from.intact()) return std::nullopt;
  if constexpr (std::same_as<RecordType, Message>) record.data = content.subspan(message_header_bytes);
  return record;
}

template <class RecordType>
void append(Buffer& out, const RecordType& record) {
  if constexpr (std::same_as<RecordType, Message>) {
    const auto head = message_head(record, record.data.size());
    out.insert(out.end(), head.begin(), head.end());
    out.insert(out.end(), record.data.begin(), record.data.end());
  } else {
    FieldWriter to(out, RecordType::opcode);
    fields(to, record);
  }
}

void append_chunk_head(Buffer& out, const Chunk& chunk, std::uint64_t records_bytes) {
  const std::size_t begin = out.size();
  {
    FieldWriter to(out, Opcode::chunk);
    chunk_head(to, chunk);
    to(records_bytes);
  }
  const std::uint64_t length = out.size() - begin - record_prefix_bytes + records_bytes;
  std::memcpy(out.data() + begin + 1, &length, sizeof length);
}

std::array<std::byte, record_prefix_bytes + message_header_bytes> message_head(const Message& message,
                                                                               std::uint64_t data_bytes) noexcept {
  std::array<std::byte, record_prefix_bytes + message_header_bytes> head{};
  std::byte* to = head.data();
  const auto put = [&](const auto&... numbers) {
    ((std::memcpy(to, &numbers, sizeof numbers), to += sizeof numbers), ...);
  };
  put(Opcode::message, std::uint64_t{message_header_bytes} + data_bytes);
  fields(put, message);
  return head;
}

ChunkIndex index_entry(const Chunk& chunk, std::uint64_t start, std::uint64_t length) {
  const std::uint64_t stored = chunk.records.size();
  return {chunk.start_time, chunk.end_time, start, length, {}, 0, chunk.compression, stored, chunk.uncompressed_size};
}

#define LBEA_RECORD(Type)                    \
  template std::optional<Type> parse(Bytes); \
  template void append(Buffer&, const Type&);
LBEA_RECORD(Header)
LBEA_RECORD(Footer)
LBEA_RECORD(Schema)
LBEA_RECORD(Channel)
LBEA_RECORD(Message)
LBEA_RECORD(Chunk)
LBEA_RECORD(MessageIndex)
LBEA_RECORD(ChunkIndex)
LBEA_RECORD(Attachment)
LBEA_RECORD(AttachmentIndex)
LBEA_RECORD(Statistics)
LBEA_RECORD(Metadata)
LBEA_RECORD(MetadataIndex)
LBEA_RECORD(SummaryOffset)
LBEA_RECORD(DataEnd)
}  // namespace lbea::mcap
