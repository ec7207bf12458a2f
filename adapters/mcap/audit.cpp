#include "adapters/mcap/audit.hpp"

#include "adapters/mcap/audit_tally.hpp"
#include "adapters/mcap/crc32.hpp"

#include <algorithm>
#include <utility>

namespace lbea::mcap {
namespace {

std::uint32_t crc_with(const Record& record, std::uint32_t before) {
  std::array<std::byte, record_prefix_bytes> prefix{static_cast<std::byte>(record.opcode)};
  std::memcpy(prefix.data() + 1, &record.length, sizeof record.length);
  return crc32(record.content, crc32(prefix, before));
}

std::uint64_t attachment_crc_bytes(const Attachment& attachment) {
  return 3 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t) + attachment.name.size() + attachment.media_type.size() +
         attachment.data.size();
}

}  // namespace

void AuditTally::complain(std::uint64_t byte, const std::string& what) {
  if (audit_.complaints.size() < Audit::max_complaints)
    audit_.complaints.push_back("byte " + std::to_string(byte) + ": " + what);
}

void AuditTally::take(const Record& record, const OpenChunk& chunk) {
  switch (record.opcode) {
    case Opcode::chunk:
      return take_chunk(record, chunk);
    case Opcode::message_index:
      return take_index(record);
    case Opcode::attachment:
      return take_attachment(record);
    case Opcode::message:
      return take_message(record, record.offset, false);
    default:
      return take_simple(record);
  }
}

void AuditTally::take_simple(const Record& record) {
  if (record.opcode == Opcode::header) {
    audit_.header = *parse<Header>(record.content);
  } else if (record.opcode == Opcode::metadata) {
    auto metadata = parse<Metadata>(record.content);
    metadata_.push_back({record.offset, record.end() - record.offset, metadata->name});
    audit_.metadata.push_back(std::move(*metadata));
    ++audit_.counted.metadata;
  } else if (!audit_.definitions.take(record)) {
    complain(record.offset, "a schema or channel differs from one with the same id");
  }
}

void AuditTally::take_message(const Record& record, std::uint64_t offset, bool in_chunk) {
  const Message message = *parse<Message>(record.content);
  if (in_chunk) {
    MessageIndex& index = expected_[message.channel_id];
    index.channel_id = message.channel_id;
    index.entries.push_back({message.log_time, record.offset});
  }
  const auto channel = audit_.definitions.channels.find(message.channel_id);
  const bool known = channel != audit_.definitions.channels.end();
  if (!known) complain(offset, "a message on channel " + std::to_string(message.channel_id) + ", which is not defined");
  Statistics& counted = audit_.counted;
  const bool first = counted.messages++ == 0;
  counted.start_time = first ? message.log_time : std::min(counted.start_time, message.log_time);
  counted.end_time = std::max(counted.end_time, message.log_time);
  ++counted.messages_by_channel[message.channel_id];
  if (visit_) visit_(message, known ? &channel->second : nullptr);
}

void AuditTally::take_chunk(const Record& record, const OpenChunk& open) {
  const Chunk& chunk = open.chunk();
  expected_.clear();
  Bytes rest = open.records();
  std::uint64_t offset = 0;
  while (const auto inner = next_record(rest, offset)) {
    if (inner->opcode == Opcode::message)
      take_message(*inner, record.offset, true);
    else
      take_simple(*inner);
  }
  std::uint64_t start = 0, end = 0;
  bool first = true;
  for (const auto& [channel, index] : expected_)
    for (const auto& entry : index.entries) {
      start = std::exchange(first, false) ? entry.log_time : std::min(start, entry.log_time);
      end = std::max(end, entry.log_time);
    }
  if (chunk.start_time != start || chunk.end_time != end)
    complain(record.offset, "the chunk's times are not those of its messages");
  chunks_.push_back({chunk.start_time,
                     chunk.end_time,
                     record.offset,
                     record.end() - record.offset,
                     {},
                     0,
                     chunk.compression,
                     chunk.records.size(),
                     chunk.uncompressed_size});
  ++audit_.counted.chunks;
}

void AuditTally::take_index(const Record& record) {
  const MessageIndex index = *parse<MessageIndex>(record.content);
  const auto expected = expected_.find(index.channel_id);
  auto entries = index.entries;
  std::ranges::sort(entries, {}, &MessageIndex::Entry::offset);
  if (expected == expected_.end() ? !entries.empty() : expected->second.entries != entries)
    complain(record.offset, "a message index that does not fit its chunk");
  if (chunks_.empty()) return;
  chunks_.back().message_index_offsets[index.channel_id] = record.offset;
  chunks_.back().message_index_length += record.end() - record.offset;
}

void AuditTally::take_attachment(const Record& record) {
  const Attachment attachment = *parse<Attachment>(record.content);
  const Bytes covered = record.content.first(static_cast<std::size_t>(attachment_crc_bytes(attachment)));
  if (attachment.crc != 0 && crc32(covered) != attachment.crc)
    complain(record.offset, "an attachment with a wrong checksum");
  attachments_.push_back({record.offset, record.end() - record.offset, attachment.log_time, attachment.create_time,
                          attachment.data.size(), attachment.name, attachment.media_type});
  ++audit_.counted.attachments;
}

Audit audit(const ByteSource& source, const MessageVisitor& visit) {
  Audit audit;
  audit.bytes = source.size();
  AuditTally tally(audit, visit);
  SalvageWalk walk(source);
  audit.is_mcap = walk.starts_with_magic();
  std::uint32_t crc = crc32(std::as_bytes(std::span(magic)));
  while (const auto record = walk.next()) {
    tally.take(*record, walk.chunk());
    if (record->opcode == Opcode::data_end) {
      const std::uint32_t stored = parse<DataEnd>(record->content)->data_section_crc;
      if (stored != 0 && stored != crc && walk.gaps().empty())
        tally.complain(record->offset, "the data's checksum is wrong");
    }
    crc = crc_with(*record, crc);
  }
  audit.gaps = walk.gaps();
  audit.counted.schemas = static_cast<std::uint16_t>(audit.definitions.schemas.size());
  audit.counted.channels = static_cast<std::uint32_t>(audit.definitions.channels.size());
  if (walk.reached_data_end()) audit_summary(source, walk.position(), tally, audit);
  return audit;
}

}  // namespace lbea::mcap
