#include "adapters/mcap/salvage.hpp"

#include <algorithm>
#include <utility>

namespace lbea::mcap {
namespace {
constexpr std::uint64_t footer_content_bytes = 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t);
constexpr std::uint64_t footer_bytes = record_prefix_bytes + footer_content_bytes;

std::uint32_t crc_with(const Record& record, std::uint32_t before) {
  std::array<std::byte, record_prefix_bytes> prefix{static_cast<std::byte>(record.opcode)};
  std::memcpy(prefix.data() + 1, &record.length, sizeof record.length);
  return crc32(record.content, crc32(prefix, before));
}

std::uint64_t bytes_covered_by_crc(const Attachment& attachment) {
  return 3 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t) + attachment.name.size() + attachment.media_type.size() +
         attachment.data.size();
}

/// The data section: counts its records, checks chunks against their message indexes, and keeps what the summary should
/// say.
class DataCheck {
 public:
  DataCheck(FileCheck& result, const MessageVisitor& visit) : result_(result), visit_(visit) {}
  void add(const Record& record, const OpenChunk& chunk) {
    if (record.opcode == Opcode::chunk) return add_chunk(record, chunk);
    if (record.opcode == Opcode::message_index) return add_index(record);
    if (record.opcode == Opcode::attachment) return add_attachment(record);
    if (record.opcode == Opcode::message) return add_message(record, record.offset, false);
    add_simple(record);
  }
  void add_error(std::uint64_t byte, const std::string& what) {
    if (result_.errors.size() < FileCheck::max_errors)
      result_.errors.push_back("byte " + std::to_string(byte) + ": " + what);
  }
  [[nodiscard]] const FileCheck& result() const noexcept { return result_; }

  // What the summary's index should contain.
  std::vector<ChunkIndex> chunks;
  std::vector<MetadataIndex> metadata;
  std::vector<AttachmentIndex> attachments;

 private:
  void add_simple(const Record& record) {
    if (record.opcode == Opcode::header) {
      result_.header = *parse<Header>(record.content);
    } else if (record.opcode == Opcode::metadata) {
      auto content = parse<Metadata>(record.content);
      metadata.push_back({record.offset, record.end() - record.offset, content->name});
      result_.metadata.push_back(std::move(*content));
      ++result_.counted.metadata;
    } else if (!result_.definitions.add(record)) {
      add_error(record.offset, "a schema or channel differs from the one with the same id");
    }
  }

  void add_message(const Record& record, std::uint64_t offset, bool in_chunk) {
    const Message message = *parse<Message>(record.content);
    if (in_chunk) {
      MessageIndex& index = expected_[message.channel_id];
      index.channel_id = message.channel_id;
      index.entries.push_back({message.log_time, record.offset});
    }
    const auto& channels = result_.definitions.channels;
    const auto channel = channels.find(message.channel_id);
    const bool known = channel != channels.end();
    if (!known)
      add_error(offset, "a message on channel " + std::to_string(message.channel_id) + ", which is not defined");
    result_.counted.add(message.channel_id, message.log_time);
    if (visit_) visit_(message, known ? &channel->second : nullptr);
  }

  void add_chunk(const Record& record, const OpenChunk& open) {
    const Chunk& chunk = open.chunk();
    expected_.clear();
    Bytes rest = open.records();
    std::uint64_t offset = 0;
    while (const auto inner = next_record(rest, offset)) {
      if (inner->opcode == Opcode::message)
        add_message(*inner, record.offset, true);
      else
        add_simple(*inner);
    }
    Statistics counted;
    for (const auto& [channel, index] : expected_)
      for (const auto& entry : index.entries) counted.add(channel, entry.log_time);
    if (chunk.start_time != counted.start_time || chunk.end_time != counted.end_time)
      add_error(record.offset, "the chunk's times differ from those of its messages");
    chunks.push_back(index_entry(chunk, record.offset, record.end() - record.offset));
    ++result_.counted.chunks;
  }

  void add_index(const Record& record) {
    const MessageIndex index = *parse<MessageIndex>(record.content);
    const auto expected = expected_.find(index.channel_id);
    auto entries = index.entries;
    std::ranges::sort(entries, {}, &MessageIndex::Entry::offset);
    if (expected == expected_.end() ? !entries.empty() : expected->second.entries != entries)
      add_error(record.offset, "a message index that does not match its chunk");
    if (chunks.empty()) return;
    chunks.back().message_index_offsets[index.channel_id] = record.offset;
    chunks.back().message_index_length += record.end() - record.offset;
  }
  void add_attachment(const Record& record) {
    const Attachment attachment = *parse<Attachment>(record.content);
    const Bytes covered = record.content.first(static_cast<std::size_t>(bytes_covered_by_crc(attachment)));
    if (attachment.crc != 0 && crc32(covered) != attachment.crc)
      add_error(record.offset, "an attachment with a wrong checksum");
    attachments.push_back({record.offset, record.end() - record.offset, attachment.log_time, attachment.create_time,
                           attachment.data.size(), attachment.name, attachment.media_type});
    ++result_.counted.attachments;
  }

  FileCheck& result_;
  const MessageVisitor& visit_;
  std::map<std::uint16_t, MessageIndex> expected_;  // of the last chunk
};

/// Everything after the data section: summary, summary offsets, footer, magic bytes.
class Tail {
 public:
  Tail(const ByteSource& source, std::uint64_t begin)
      : begin_(begin), bytes_(static_cast<std::size_t>(source.size() - begin)) {
    source.read(begin, bytes_);
  }
  [[nodiscard]] std::uint64_t begin() const { return begin_; }
  [[nodiscard]] Bytes bytes() const { return bytes_; }
  [[nodiscard]] std::uint64_t footer_start() const { return begin_ + bytes_.size() - footer_bytes - magic.size(); }
  [[nodiscard]] std::optional<Footer> footer() const {
    if (bytes_.size() < footer_bytes + magic.size()) return std::nullopt;
    Bytes rest = Bytes(bytes_).last(footer_bytes + magic.size());
    if (!std::ranges::equal(rest.last(magic.size()), std::as_bytes(std::span(magic)))) return std::nullopt;
    std::uint64_t offset = 0;
    const auto record = next_record(rest, offset);
    if (!record || record->opcode != Opcode::footer || record->length != footer_content_bytes) return std::nullopt;
    return parse<Footer>(record->content);
  }
  /// Whether the footer's offsets fit this tail.
  [[nodiscard]] bool has_bounds(const Footer& footer) const {
    const std::uint64_t end = footer_start();
    if (footer.summary_start == 0) return begin_ == end;
    const bool offsets_fit = footer.summary_offset_start == 0 || (footer.summary_offset_start >= footer.summary_start &&
                                                                  footer.summary_offset_start <= end);
    return footer.summary_start == begin_ && footer.summary_start <= end && offsets_fit;
  }

 private:
  std::uint64_t begin_;
  Buffer bytes_;
};

std::uint64_t place_of(const ChunkIndex& index) { return index.chunk_start; }
std::uint64_t place_of(const auto& index) { return index.offset; }

/// Whether `entry` is one of `items`, which have the order of the file.
template <class Item>
bool has(const std::vector<Item>& items, const Item& entry) {
  const auto place = [](const Item& item) { return place_of(item); };
  const auto found = std::ranges::lower_bound(items, place_of(entry), {}, place);
  return found != items.end() && *found == entry;
}

/// Compares the summary with the data.
class SummaryCheck {
 public:
  SummaryCheck(DataCheck& data, std::uint64_t begin)
      : data_(data), begin_(begin), definitions_(data.result().definitions) {}

  void add(const Record& record) {
    const std::uint64_t at = begin_ + record.offset;
    const Opcode kind = record.opcode;
    if (kind == Opcode::schema || kind == Opcode::channel) add_definition(at, record);
    if (kind == Opcode::statistics) add_statistics(at, record);
    if (kind == Opcode::chunk_index) add_index(at, record, data_.chunks, chunks_);
    if (kind == Opcode::attachment_index) add_index(at, record, data_.attachments, attachments_);
    if (kind == Opcode::metadata_index) add_index(at, record, data_.metadata, metadata_);
  }
  void close() {
    expect(begin_, is_complete(chunks_, data_.chunks), "an index without some of the chunks");
    expect(begin_, is_complete(metadata_, data_.metadata), "an index without some of the metadata");
    expect(begin_, is_complete(attachments_, data_.attachments), "an index without some of the attachments");
  }

 private:
  void expect(std::uint64_t at, bool good, const char* otherwise) {
    if (!good) data_.add_error(at, std::string("the summary has ") + otherwise);
  }
  /// An index may be absent as a whole.
  static bool is_complete(std::size_t entries, const auto& items) { return entries == 0 || entries == items.size(); }
  /// A summary repeats the definitions of the data and adds none.
  void add_definition(std::uint64_t at, const Record& record) {
    const auto known = [&] { return definitions_.schemas.size() + definitions_.channels.size(); };
    const std::size_t before = known();
    const bool agrees = definitions_.add(record);
    expect(at, agrees && known() == before, "a definition that differs from the data");
  }
  void add_statistics(std::uint64_t at, const Record& record) {
    const auto statistics = parse<Statistics>(record.content);
    expect(at, statistics && *statistics == data_.result().counted, "wrong statistics");
  }
  template <class Item>
  void add_index(std::uint64_t at, const Record& record, const std::vector<Item>& items, std::size_t& entries) {
    const auto entry = parse<Item>(record.content);
    ++entries;
    expect(at, entry && has(items, *entry), "an index entry that matches no record");
  }
  DataCheck& data_;
  std::uint64_t begin_;
  Definitions definitions_;
  std::size_t chunks_ = 0, metadata_ = 0, attachments_ = 0;  // entries of the indexes
};

void check_summary(const ByteSource& source, std::uint64_t data_end, DataCheck& data, FileCheck& result) {
  const Tail tail(source, data_end);
  const auto footer = tail.footer();
  if (!footer) return;
  result.is_closed = true;
  result.has_summary = footer->summary_start != 0;
  if (!tail.has_bounds(*footer)) return data.add_error(tail.footer_start(), "the footer points to the wrong place");
  const Bytes covered = tail.bytes().first(tail.bytes().size() - magic.size() - sizeof(std::uint32_t));
  if (footer->summary_crc != 0 && crc32(covered) != footer->summary_crc)
    return data.add_error(tail.begin(), "the summary's checksum is wrong");
  SummaryCheck check(data, tail.begin());
  Bytes rest = tail.bytes().first(static_cast<std::size_t>(tail.footer_start() - tail.begin()));
  std::uint64_t offset = 0;
  while (const auto record = next_record(rest, offset)) check.add(*record);
  if (!rest.empty()) data.add_error(tail.begin() + offset, "the summary is damaged");
  check.close();
}
}  // namespace

FileCheck check_file(const ByteSource& source, const MessageVisitor& visit) {
  FileCheck result;
  result.bytes = source.size();
  DataCheck data(result, visit);
  SalvageReader reader(source);
  result.is_mcap = reader.starts_with_magic();
  std::uint32_t crc = crc32(std::as_bytes(std::span(magic)));
  while (const auto record = reader.next()) {
    data.add(*record, reader.chunk());
    if (record->opcode == Opcode::data_end) {
      const std::uint32_t stored = parse<DataEnd>(record->content)->data_section_crc;
      if (stored != 0 && stored != crc && reader.gaps().empty())
        data.add_error(record->offset, "the data's checksum is wrong");
    }
    crc = crc_with(*record, crc);
  }
  result.gaps = reader.gaps();
  result.counted.schemas = static_cast<std::uint16_t>(result.definitions.schemas.size());
  result.counted.channels = static_cast<std::uint32_t>(result.definitions.channels.size());
  if (reader.reached_data_end()) check_summary(source, reader.position(), data, result);
  return result;
}
}  // namespace lbea::mcap
