#include "adapters/mcap/mcap_records.hpp"

#include <algorithm>

namespace lbea::mcap {
namespace {

/// Appends one record; its length is filled in at the end of the scope.
class RecordWriter {
 public:
  RecordWriter(Buffer& out, Opcode opcode) : out_(out) {
    out_.push_back(static_cast<std::byte>(opcode));
    number(std::uint64_t{0});
    begin_ = out_.size();
  }
  ~RecordWriter() { patch<std::uint64_t>(begin_); }
  RecordWriter(const RecordWriter&) = delete;
  RecordWriter& operator=(const RecordWriter&) = delete;

  template <class Number>
  void number(Number value) {
    bytes(std::as_bytes(std::span{&value, 1}));
  }
  void bytes(Bytes data) { out_.insert(out_.end(), data.begin(), data.end()); }
  void text(std::string_view text) { block<std::uint32_t>(std::as_bytes(std::span{text})); }
  template <class Length>
  void block(Bytes data) {
    number(static_cast<Length>(data.size()));
    bytes(data);
  }
  /// What `write` appends, preceded by its length as u32.
  template <class Write>
  void counted(Write write) {
    number(std::uint32_t{0});
    const std::size_t begin = out_.size();
    write();
    patch<std::uint32_t>(begin);
  }

 private:
  template <class Length>
  void patch(std::size_t begin) {
    const auto length = static_cast<Length>(out_.size() - begin);
    std::memcpy(out_.data() + begin - sizeof length, &length, sizeof length);
  }
  Buffer& out_;
  std::size_t begin_ = 0;
};

void append_texts(RecordWriter& to, const Texts& texts) {
  to.counted([&] {
    for (const auto& [key, text] : texts) {
      to.text(key);
      to.text(text);
    }
  });
}

void append_numbers(RecordWriter& to, const std::map<std::uint16_t, std::uint64_t>& numbers) {
  to.counted([&] {
    for (const auto& [channel, number] : numbers) {
      to.number(channel);
      to.number(number);
    }
  });
}

}  // namespace

void append(Buffer& out, const Header& record) {
  RecordWriter to(out, Opcode::header);
  to.text(record.profile);
  to.text(record.library);
}

void append(Buffer& out, const Footer& record) {
  RecordWriter to(out, Opcode::footer);
  to.number(record.summary_start);
  to.number(record.summary_offset_start);
  to.number(record.summary_crc);
}

void append(Buffer& out, const Schema& record) {
  RecordWriter to(out, Opcode::schema);
  to.number(record.id);
  to.text(record.name);
  to.text(record.encoding);
  to.block<std::uint32_t>(record.data);
}

void append(Buffer& out, const Channel& record) {
  RecordWriter to(out, Opcode::channel);
  to.number(record.id);
  to.number(record.schema_id);
  to.text(record.topic);
  to.text(record.message_encoding);
  append_texts(to, record.metadata);
}

void append(Buffer& out, const Message& record) {
  const auto head = message_head(record, record.data.size());
  out.insert(out.end(), head.begin(), head.end());
  out.insert(out.end(), record.data.begin(), record.data.end());
}

void append(Buffer& out, const MessageIndex& record) {
  RecordWriter to(out, Opcode::message_index);
  to.number(record.channel_id);
  to.counted([&] {
    for (const auto& entry : record.entries) {
      to.number(entry.log_time);
      to.number(entry.offset);
    }
  });
}

void append(Buffer& out, const ChunkIndex& record) {
  RecordWriter to(out, Opcode::chunk_index);
  to.number(record.start_time);
  to.number(record.end_time);
  to.number(record.chunk_start);
  to.number(record.chunk_length);
  append_numbers(to, record.message_index_offsets);
  to.number(record.message_index_length);
  to.text(record.compression);
  to.number(record.compressed_size);
  to.number(record.uncompressed_size);
}

void append(Buffer& out, const Attachment& record) {
  RecordWriter to(out, Opcode::attachment);
  to.number(record.log_time);
  to.number(record.create_time);
  to.text(record.name);
  to.text(record.media_type);
  to.block<std::uint64_t>(record.data);
  to.number(record.crc);
}

void append(Buffer& out, const AttachmentIndex& record) {
  RecordWriter to(out, Opcode::attachment_index);
  to.number(record.offset);
  to.number(record.length);
  to.number(record.log_time);
  to.number(record.create_time);
  to.number(record.data_size);
  to.text(record.name);
  to.text(record.media_type);
}

void append(Buffer& out, const Statistics& record) {
  RecordWriter to(out, Opcode::statistics);
  to.number(record.messages);
  to.number(record.schemas);
  to.number(record.channels);
  to.number(record.attachments);
  to.number(record.metadata);
  to.number(record.chunks);
  to.number(record.start_time);
  to.number(record.end_time);
  append_numbers(to, record.messages_by_channel);
}

void append(Buffer& out, const Metadata& record) {
  RecordWriter to(out, Opcode::metadata);
  to.text(record.name);
  append_texts(to, record.texts);
}

void append(Buffer& out, const MetadataIndex& record) {
  RecordWriter to(out, Opcode::metadata_index);
  to.number(record.offset);
  to.number(record.length);
  to.text(record.name);
}

void append(Buffer& out, const SummaryOffset& record) {
  RecordWriter to(out, Opcode::summary_offset);
  to.number(static_cast<std::uint8_t>(record.group));
  to.number(record.group_start);
  to.number(record.group_length);
}

void append(Buffer& out, const DataEnd& record) { RecordWriter(out, Opcode::data_end).number(record.data_section_crc); }

void append_chunk_head(Buffer& out, const Chunk& chunk, std::uint64_t records_bytes) {
  const std::size_t begin = out.size();
  {
    RecordWriter to(out, Opcode::chunk);
    to.number(chunk.start_time);
    to.number(chunk.end_time);
    to.number(chunk.uncompressed_size);
    to.number(chunk.uncompressed_crc);
    to.text(chunk.compression);
    to.number(records_bytes);
  }
  const std::uint64_t length = out.size() - begin - record_prefix_bytes + records_bytes;
  std::memcpy(out.data() + begin + 1, &length, sizeof length);
}

std::array<std::byte, record_prefix_bytes + message_header_bytes> message_head(const Message& message,
                                                                               std::uint64_t data_bytes) noexcept {
  std::array<std::byte, record_prefix_bytes + message_header_bytes> head{};
  std::byte* to = head.data();
  const auto put = [&](auto number) {
    std::memcpy(to, &number, sizeof number);
    to += sizeof number;
  };
  put(Opcode::message);
  put(std::uint64_t{message_header_bytes} + data_bytes);
  put(message.channel_id);
  put(message.sequence);
  put(message.log_time);
  put(message.publish_time);
  return head;
}

}  // namespace lbea::mcap
