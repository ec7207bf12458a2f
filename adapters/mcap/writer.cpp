#include "adapters/mcap/writer.hpp"

#include <cerrno>

namespace lbea::mcap {
namespace {
constexpr std::size_t footer_crc_bytes = sizeof(std::uint32_t);

/// Appends groups of summary records, and for each non-empty group its offset.
class SummaryBuilder {
 public:
  explicit SummaryBuilder(std::uint64_t start) : start_(start) {}
  void group(const auto& items) {
    if (std::ranges::empty(items)) return;
    const std::size_t begin = summary.size();
    for (const auto& item : items) append(summary, record_of(item));
    const Opcode opcode = std::remove_cvref_t<decltype(record_of(*std::ranges::begin(items)))>::opcode;
    append(offsets, SummaryOffset{opcode, start_ + begin, summary.size() - begin});
  }
  Buffer summary, offsets;

 private:
  static const auto& record_of(const auto& record) { return record; }
  template <class Id, class RecordType>
  static const RecordType& record_of(const std::pair<Id, RecordType>& definition) {
    return definition.second;
  }
  std::uint64_t start_;
};
}  // namespace

Writer::Writer(Sink& sink, Compression compression) : sink_(sink), compression_(compression) {}

int Writer::begin(const Header& header) {
  const Bytes start = std::as_bytes(std::span(magic));
  buffer_.assign(start.begin(), start.end());
  mcap::append(buffer_, header);
  return append_buffer();
}

int Writer::append(std::span<const Bytes> pieces, std::uint32_t crc) {
  if (const int error = sink_.append(pieces); error != 0) return error;
  const std::uint64_t bytes = total_size(pieces);
  crc_ = crc32_joined(crc_, crc, bytes);
  size_ += bytes;
  return 0;
}

int Writer::append_buffer() {
  const Bytes bytes = buffer_;
  return append({&bytes, 1}, crc32(bytes));
}

int Writer::append_record(const auto& record) {
  buffer_.clear();
  mcap::append(buffer_, record);
  return append_buffer();
}

Writer::Contents Writer::survey(std::span<const Bytes> pieces) {
  Contents contents;
  std::uint64_t offset = 0;
  for (Bytes rest : pieces) {
    while (const auto record = next_record(rest, offset)) {
      static_cast<void>(contents.defined.add(*record));
      if (record->opcode != Opcode::message) continue;
      const auto message = parse<Message>(record->content);
      if (!message) continue;
      MessageIndex& index = contents.index[message->channel_id];
      index.channel_id = message->channel_id;
      index.entries.push_back({message->log_time, record->offset});
      contents.counted.add(message->channel_id, message->log_time);
    }
  }
  return contents;
}

int Writer::chunk(std::span<const Bytes> pieces) {
  Contents contents = survey(pieces);
  const Statistics& counted = contents.counted;
  Chunk chunk{counted.start_time, counted.end_time, total_size(pieces), 0, std::string(name_of(compression_)), {}};
  for (const Bytes piece : pieces) chunk.uncompressed_crc = crc32(piece, chunk.uncompressed_crc);
  Stored stored{{}, pieces, chunk.uncompressed_size, chunk.uncompressed_crc};
  Bytes compressed;
  if (compression_ != Compression::none) {
    buffer_.clear();
    if (!compress(compression_, pieces, buffer_)) return ENOMEM;
    compressed = buffer_;
    stored = {{}, {&compressed, 1}, compressed.size(), crc32(compressed)};
  }
  head_.clear();
  append_chunk_head(head_, chunk, stored.records_bytes);
  stored.head = head_;
  return append_chunk(stored, chunk, contents);
}

int Writer::chunk_as_is(Chunk chunk, Bytes records) {
  Contents contents = survey({&records, 1});
  chunk.start_time = contents.counted.start_time;  // the checksum of the old file does not cover its times
  chunk.end_time = contents.counted.end_time;
  head_.clear();
  append_chunk_head(head_, chunk, chunk.records.size());
  return append_chunk({head_, {&chunk.records, 1}, chunk.records.size(), crc32(chunk.records)}, chunk, contents);
}

int Writer::append_chunk(const Stored& stored, const Chunk& chunk, Contents& contents) {
  ChunkIndex entry = index_entry(chunk, size_, stored.head.size() + stored.records_bytes);
  entry.compressed_size = stored.records_bytes;
  index_.clear();
  const std::uint64_t index_start = entry.chunk_start + entry.chunk_length;
  for (const auto& [channel, index] : contents.index) {
    entry.message_index_offsets[channel] = index_start + index_.size();
    mcap::append(index_, index);
  }
  entry.message_index_length = index_.size();
  std::vector<Bytes> pieces{stored.head};
  pieces.insert(pieces.end(), stored.records.begin(), stored.records.end());
  pieces.push_back(index_);
  std::uint32_t crc = crc32_joined(crc32(stored.head), stored.records_crc, stored.records_bytes);
  crc = crc32(index_, crc);
  chunks_.push_back(std::move(entry));  // before the sink is called: allocating afterwards could fail
  if (const int error = append(pieces, crc); error != 0) {
    chunks_.pop_back();
    return error;
  }
  add_to_summary(contents);
  return 0;
}

// The chunk is in the file, so nothing may fail here. merge() moves the nodes that survey() allocated.
void Writer::add_to_summary(Contents& contents) noexcept {
  ++statistics_.chunks;
  definitions_.schemas.merge(contents.defined.schemas);
  definitions_.channels.merge(contents.defined.channels);
  auto& counts = statistics_.messages_by_channel;
  Statistics& counted = contents.counted;
  for (const auto& [channel, messages] : counted.messages_by_channel)
    if (const auto known = counts.find(channel); known != counts.end()) known->second += messages;
  counts.merge(counted.messages_by_channel);
  if (counted.messages == 0) return;
  const bool first = statistics_.messages == 0;
  statistics_.start_time = first ? counted.start_time : std::min(statistics_.start_time, counted.start_time);
  statistics_.end_time = std::max(statistics_.end_time, counted.end_time);
  statistics_.messages += counted.messages;
}

int Writer::define(const Schema& schema) {
  const int error = append_record(schema);
  if (error == 0) definitions_.schemas.try_emplace(schema.id, schema);
  return error;
}

int Writer::define(const Channel& channel) {
  const int error = append_record(channel);
  if (error == 0) definitions_.channels.try_emplace(channel.id, channel);
  return error;
}

int Writer::metadata(const Metadata& metadata) {
  buffer_.clear();
  mcap::append(buffer_, metadata);
  metadata_.push_back({size_, buffer_.size(), metadata.name});
  const int error = append_buffer();
  if (error == 0)
    ++statistics_.metadata;
  else
    metadata_.pop_back();
  return error;
}

int Writer::attachment(const Attachment& attachment) {
  buffer_.clear();
  mcap::append(buffer_, attachment);
  attachments_.push_back({size_, buffer_.size(), attachment.log_time, attachment.create_time, attachment.data.size(),
                          attachment.name, attachment.media_type});
  const int error = append_buffer();
  if (error == 0)
    ++statistics_.attachments;
  else
    attachments_.pop_back();
  return error;
}

int Writer::finish() {
  statistics_.schemas = static_cast<std::uint16_t>(definitions_.schemas.size());
  statistics_.channels = static_cast<std::uint32_t>(definitions_.channels.size());
  buffer_.clear();
  mcap::append(buffer_, DataEnd{crc_});
  const std::uint64_t summary_start = size_ + buffer_.size();
  SummaryBuilder to(summary_start);
  to.group(definitions_.schemas);
  to.group(definitions_.channels);
  to.group(std::span(&statistics_, 1));
  to.group(chunks_);
  to.group(attachments_);
  to.group(metadata_);
  Buffer footer;
  mcap::append(footer, Footer{summary_start, summary_start + to.summary.size(), 0});
  const Bytes covered = Bytes(footer).first(footer.size() - footer_crc_bytes);
  const std::uint32_t crc = crc32(covered, crc32(to.offsets, crc32(to.summary)));
  std::memcpy(footer.data() + covered.size(), &crc, sizeof crc);
  const std::array<Bytes, 5> pieces{buffer_, to.summary, to.offsets, footer, std::as_bytes(std::span(magic))};
  const int error = sink_.append(pieces);
  if (error == 0) size_ += total_size(pieces);
  return error;
}
}  // namespace lbea::mcap
