#include "adapters/mcap/salvage.hpp"

namespace lbea::mcap {
namespace {
constexpr std::size_t window_bytes = std::size_t{1} << 20;
// Headers of chunks may be nested, each of which claims the rest of the file.
constexpr std::uint64_t least_search = std::uint64_t{64} << 20, searches_per_file = 8;
constexpr std::uint64_t fixed_chunk_bytes = 4 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t);

bool has_magic(const ByteSource& source) {
  if (source.size() < magic.size()) return false;
  std::array<std::byte, magic.size()> bytes{};
  source.read(0, bytes);
  return std::ranges::equal(bytes, std::as_bytes(std::span(magic)));
}

/// Excludes nearly all positions without reading a record.
bool may_be_anchor(Bytes here, std::uint64_t left) {
  const auto opcode = static_cast<Opcode>(here[0]);
  if (opcode != Opcode::chunk && opcode != Opcode::metadata) return false;
  if (here.size() < record_prefix_bytes) return true;
  ByteCursor cursor(here.subspan(1));
  return cursor.number<std::uint64_t>() < left;
}

/// The sizes and the name of a chunk agree with the length of its record.
bool is_plausible_chunk(Bytes front, std::uint64_t length) {
  ByteCursor cursor(front);
  cursor.block(3 * sizeof(std::uint64_t) + sizeof(std::uint32_t));
  const std::uint64_t name_bytes = cursor.number<std::uint32_t>();
  if (name_bytes > 4) return false;
  cursor.block(name_bytes);
  const auto records = cursor.number<std::uint64_t>();
  const std::uint64_t fixed = fixed_chunk_bytes + name_bytes;
  return cursor.intact() && length >= fixed && records == length - fixed;
}

bool is_private(Opcode opcode) { return static_cast<std::uint8_t>(opcode) >= 0x80; }

template <class RecordType>
std::optional<std::uint64_t> size_as(const Record& record) {
  const auto parsed = parse<RecordType>(record.content);
  if (!parsed) return std::nullopt;
  Buffer again;
  append(again, *parsed);
  return again.size() - record_prefix_bytes;
}

/// The same for the type with the record's opcode. False when none of `Types` has it.
template <class... Types>
bool find_size(const Record& record, std::optional<std::uint64_t>& size) {
  return ((record.opcode == Types::opcode && (size = size_as<Types>(record), true)) || ...);
}

/// The length of the content without surplus bytes. Nothing for a record that cannot be parsed or does not belong in
/// the data section.
std::optional<std::uint64_t> sound_size(const Record& record) {
  std::optional<std::uint64_t> size;
  if (find_size<Header, Schema, Channel, Message, MessageIndex, Attachment, Metadata, DataEnd>(record, size))
    return size;
  if (is_private(record.opcode)) return record.length;
  if (record.opcode != Opcode::chunk) return std::nullopt;
  if (const auto chunk = parse<Chunk>(record.content))
    size = fixed_chunk_bytes + chunk->compression.size() + chunk->records.size();
  return size;
}
}  // namespace

SalvageReader::SalvageReader(const ByteSource& source)
    : source_(source),
      search_budget_(least_search + searches_per_file * source.size()),
      reader_(source, magic.size(), source.size()),
      chunk_(source.size()),
      starts_with_magic_(has_magic(source)) {
  if (!starts_with_magic_) resume_after(0, "not the start of an MCAP file");
}

std::optional<Record> SalvageReader::next() {
  while (!reached_data_end_ && reader_.position() < source_.size()) {
    const std::uint64_t begin = reader_.position();
    const auto record = reader_.next();
    if (!record) {
      resume_after(begin, "cut off, or not a record");
      continue;
    }
    if (std::string flaw = flaw_of(*record); !flaw.empty()) {
      resume_after(begin, std::move(flaw));
      continue;
    }
    reached_data_end_ = record->opcode == Opcode::data_end;
    return record;
  }
  return std::nullopt;
}

/// Empty for a sound record. A record with surplus bytes at its end is sound only if another record follows: otherwise
/// its length may be damaged, and the surplus bytes may be other records.
std::string SalvageReader::flaw_of(const Record& record) {
  const auto size = sound_size(record);
  if (!size) return "damaged record of kind " + std::to_string(static_cast<unsigned>(record.opcode));
  if (record.opcode == Opcode::chunk) {
    const ChunkDamage damage = chunk_.open(record.content);
    if (damage != ChunkDamage::none) return "damaged chunk: " + std::string(to_string(damage));
    if (!are_whole(chunk_.records())) return "damaged chunk: " + std::string(to_string(ChunkDamage::bad_contents));
  }
  if (record.opcode == Opcode::data_end && !is_data_end(record)) return "damaged end of the data";
  if (*size != record.length && !may_begin_record(record.end())) return "a record with a wrong length";
  return {};
}

bool SalvageReader::may_begin_record(std::uint64_t at) const {
  if (at == source_.size()) return true;
  const auto next = FileReader(source_, at, source_.size()).peek(0);
  return next && (next->opcode <= Opcode::data_end || is_private(next->opcode));
}

/// Also checks that a summary or the footer follows, because a damaged opcode may look like the end of the data.
bool SalvageReader::is_data_end(const Record& record) const {
  if (record.content.size() != sizeof(std::uint32_t)) return false;
  if (record.end() >= source_.size()) return false;
  std::byte opcode{};
  source_.read(record.end(), {&opcode, 1});
  constexpr std::array following{Opcode::footer,        Opcode::schema,     Opcode::channel,
                                 Opcode::chunk_index,   Opcode::statistics, Opcode::attachment_index,
                                 Opcode::metadata_index};
  return std::ranges::find(following, static_cast<Opcode>(opcode)) != following.end();
}

void SalvageReader::resume_after(std::uint64_t begin, std::string what) {
  const std::uint64_t end = find_anchor(begin + 1);
  gaps_.push_back({begin, end, std::move(what)});
  reader_.go_to(end);
}

std::uint64_t SalvageReader::find_anchor(std::uint64_t from) {
  Buffer window;
  for (std::uint64_t at = from; at < source_.size(); at += window.size()) {
    window.resize(static_cast<std::size_t>(std::min<std::uint64_t>(window_bytes, source_.size() - at)));
    source_.read(at, window);
    for (std::size_t i = 0; i < window.size(); ++i)
      if (may_be_anchor(Bytes(window).subspan(i), source_.size() - at - i) && is_anchor(at + i)) return at + i;
  }
  return source_.size();
}

bool SalvageReader::is_anchor(std::uint64_t at) {
  FileReader reader(source_, at, source_.size());
  const auto front = reader.peek(64);
  if (!front) return false;
  if (front->opcode == Opcode::chunk && !is_plausible_chunk(front->content, front->length)) return false;
  if (front->length > search_budget_) return false;
  search_budget_ -= front->length;
  const auto record = reader.next();
  if (!record) return false;
  if (record->opcode == Opcode::metadata) return record->length > 0 && size_as<Metadata>(*record) == record->length;
  return chunk_.open(record->content) == ChunkDamage::none && are_whole(chunk_.records()) &&
         chunk_.chunk().uncompressed_crc != 0;
}
}  // namespace lbea::mcap
