#include "adapters/mcap/audit_tally.hpp"
#include "adapters/mcap/crc32.hpp"

#include <algorithm>

namespace lbea::mcap {
namespace {

constexpr std::uint64_t footer_content_bytes = 2 * sizeof(std::uint64_t) + sizeof(std::uint32_t);
constexpr std::uint64_t footer_bytes = record_prefix_bytes + footer_content_bytes;

/// Everything behind the data: summary, summary offsets, footer, magic.
class Tail {
 public:
  Tail(const ByteSource& source, std::uint64_t begin)
      : begin_(begin), bytes_(static_cast<std::size_t>(source.size() - begin)) {
    source.read(begin, bytes_);
  }
  [[nodiscard]] std::uint64_t begin() const { return begin_; }
  [[nodiscard]] Bytes bytes() const { return bytes_; }
  [[nodiscard]] std::optional<Footer> footer() const {
    if (bytes_.size() < footer_bytes + magic.size()) return std::nullopt;
    Bytes rest = Bytes(bytes_).last(footer_bytes + magic.size());
    if (!std::ranges::equal(rest.last(magic.size()), std::as_bytes(std::span(magic)))) return std::nullopt;
    std::uint64_t offset = 0;
    const auto record = next_record(rest, offset);
    if (!record || record->opcode != Opcode::footer || record->length != footer_content_bytes) return std::nullopt;
    return parse<Footer>(record->content);
  }
  [[nodiscard]] std::uint64_t footer_start() const { return begin_ + bytes_.size() - footer_bytes - magic.size(); }

 private:
  std::uint64_t begin_;
  Buffer bytes_;
};

bool same(const ChunkIndex& a, const ChunkIndex& b) {
  return a.start_time == b.start_time && a.end_time == b.end_time && a.chunk_start == b.chunk_start &&
         a.chunk_length == b.chunk_length && a.message_index_offsets == b.message_index_offsets &&
         a.message_index_length == b.message_index_length && a.compression == b.compression &&
         a.compressed_size == b.compressed_size && a.uncompressed_size == b.uncompressed_size;
}

bool same(const AttachmentIndex& a, const AttachmentIndex& b) {
  return a.offset == b.offset && a.length == b.length && a.log_time == b.log_time && a.create_time == b.create_time &&
         a.data_size == b.data_size && a.name == b.name && a.media_type == b.media_type;
}

bool same(const MetadataIndex& a, const MetadataIndex& b) {
  return a.offset == b.offset && a.length == b.length && a.name == b.name;
}

bool same(const Statistics& a, const Statistics& b) {
  return a.messages == b.messages && a.schemas == b.schemas && a.channels == b.channels &&
         a.attachments == b.attachments && a.metadata == b.metadata && a.chunks == b.chunks &&
         a.start_time == b.start_time && a.end_time == b.end_time && a.messages_by_channel == b.messages_by_channel;
}

/// Whether `entry` is one of `items`. Indexes usually come in the order of what they index: `hint` moves along.
template <class Item>
bool has(const std::vector<Item>& items, const Item& entry, std::size_t& hint) {
  if (hint < items.size() && same(items[hint], entry)) return ++hint, true;
  return std::ranges::any_of(items, [&](const Item& item) { return same(item, entry); });
}

class SummaryCheck {
 public:
  SummaryCheck(AuditTally& tally, std::uint64_t begin)
      : tally_(tally), begin_(begin), definitions_(tally.audit().definitions) {}

  void take(const Record& record) {
    const std::uint64_t at = begin_ + record.offset;
    switch (record.opcode) {
      case Opcode::schema:
      case Opcode::channel:
        return take_definition(at, record);
      case Opcode::statistics:
        return take_statistics(at, record);
      case Opcode::chunk_index:
        return take_index<ChunkIndex>(at, record, tally_.chunks(), chunks_);
      case Opcode::attachment_index:
        return take_index<AttachmentIndex>(at, record, tally_.attachments(), attachments_);
      case Opcode::metadata_index:
        return take_index<MetadataIndex>(at, record, tally_.metadata(), metadata_);
      default:
        return;
    }
  }
  void close() {
    if (chunks_.seen > 0) expect(begin_, chunks_.seen == tally_.chunks().size(), "chunks that the index does not know");
    if (metadata_.seen > 0)
      expect(begin_, metadata_.seen == tally_.metadata().size(), "metadata that the index does not know");
    if (attachments_.seen > 0)
      expect(begin_, attachments_.seen == tally_.attachments().size(), "attachments that the index does not know");
  }

 private:
  struct Progress {
    std::size_t hint = 0, seen = 0;
  };
  void expect(std::uint64_t at, bool good, const char* otherwise) {
    if (!good) tally_.complain(at, std::string("the summary has ") + otherwise);
  }
  /// A summary repeats what the data define, and nothing else.
  void take_definition(std::uint64_t at, const Record& record) {
    const auto known = [&] { return definitions_.schemas.size() + definitions_.channels.size(); };
    const std::size_t before = known();
    const bool agrees = definitions_.take(record);
    expect(at, agrees && known() == before, "a definition unlike that in the data");
  }
  void take_statistics(std::uint64_t at, const Record& record) {
    const auto statistics = parse<Statistics>(record.content);
    expect(at, statistics && same(*statistics, tally_.audit().counted), "statistics that are wrong");
  }
  template <class Item>
  void take_index(std::uint64_t at, const Record& record, const std::vector<Item>& items, Progress& progress) {
    const auto entry = parse<Item>(record.content);
    ++progress.seen;
    expect(at, entry && has(items, *entry, progress.hint), "an index entry that leads nowhere");
  }
  AuditTally& tally_;
  std::uint64_t begin_;
  Definitions definitions_;
  Progress chunks_, metadata_, attachments_;
};

bool bounds_are_right(const Footer& footer, const Tail& tail) {
  const std::uint64_t end = tail.footer_start();
  if (footer.summary_start == 0) return tail.begin() == end;
  const bool offsets_fit = footer.summary_offset_start == 0 ||
                           (footer.summary_offset_start >= footer.summary_start && footer.summary_offset_start <= end);
  return footer.summary_start == tail.begin() && footer.summary_start <= end && offsets_fit;
}

}  // namespace

void audit_summary(const ByteSource& source, std::uint64_t data_end, AuditTally& tally, Audit& audit) {
  const Tail tail(source, data_end);
  const auto footer = tail.footer();
  if (!footer) return;
  audit.is_closed = true;
  audit.has_summary = footer->summary_start != 0;
  if (!bounds_are_right(*footer, tail))
    return tally.complain(tail.footer_start(), "the footer points to the wrong place");
  const Bytes covered = tail.bytes().first(tail.bytes().size() - magic.size() - sizeof(std::uint32_t));
  if (footer->summary_crc != 0 && crc32(covered) != footer->summary_crc)
    return tally.complain(tail.begin(), "the summary's checksum is wrong");
  SummaryCheck check(tally, tail.begin());
  Bytes rest = tail.bytes().first(static_cast<std::size_t>(tail.footer_start() - tail.begin()));
  std::uint64_t offset = 0;
  while (const auto record = next_record(rest, offset)) check.take(*record);
  if (!rest.empty()) tally.complain(tail.begin() + offset, "the summary is damaged");
  check.close();
}

}  // namespace lbea::mcap
