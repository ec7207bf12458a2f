#include "adapters/recording/salvage.hpp"

#include <algorithm>

namespace lbea::mcap {

namespace {

constexpr std::size_t window_bytes = std::size_t{1} << 20;

bool has_magic(const ByteSource& source) {
  if (source.size() < magic.size()) return false;
  std::array<std::byte, magic.size()> bytes{};
  source.read(0, bytes);
  return std::ranges::equal(bytes, std::as_bytes(std::span(magic)));
}

constexpr std::uint64_t fixed_chunk_bytes = 4 * sizeof(std::uint64_t) + 2 * sizeof(std::uint32_t);

/// Sorts out nearly all positions before anything is read there.
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

/// Metadata whose texts fill the record to its last byte.
bool is_exact_metadata(Bytes content) {
  const auto metadata = parse<Metadata>(content);
  if (!metadata || metadata->name.empty()) return false;
  Buffer again;
  append(again, *metadata);
  return std::ranges::equal(Bytes(again).subspan(record_prefix_bytes), content);
}

}  // namespace

SalvageWalk::SalvageWalk(const ByteSource& source)
    : source_(source), walk_(source, magic.size(), source.size()), starts_with_magic_(has_magic(source)) {
  if (!starts_with_magic_) resume_after(0, "no MCAP file begins here");
}

std::optional<Record> SalvageWalk::next() {
  while (!reached_data_end_ && walk_.position() < source_.size()) {
    const std::uint64_t begin = walk_.position();
    const auto record = walk_.next();
    if (!record) {
      resume_after(begin, "cut off or no record");
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

std::string SalvageWalk::flaw_of(const Record& record) {
  const Bytes content = record.content;
  const auto unless = [](bool good, const char* what) { return std::string(good ? "" : what); };
  switch (record.opcode) {
    case Opcode::header: return unless(parse<Header>(content).has_value(), "damaged header");
    case Opcode::schema: return unless(parse<Schema>(content).has_value(), "damaged schema");
    case Opcode::channel: return unless(parse<Channel>(content).has_value(), "damaged channel");
    case Opcode::message: return unless(parse<Message>(content).has_value(), "damaged message");
    case Opcode::message_index: return unless(parse<MessageIndex>(content).has_value(), "damaged message index");
    case Opcode::attachment: return unless(parse<Attachment>(content).has_value(), "damaged attachment");
    case Opcode::metadata: return unless(parse<Metadata>(content).has_value(), "damaged metadata");
    case Opcode::data_end: return unless(is_data_end(record), "damaged end of data");
    case Opcode::chunk: {
      const ChunkDamage damage = chunk_.open(content);
      if (damage != ChunkDamage::none) return "damaged chunk: " + std::string(to_string(damage));
      return unless(are_whole(chunk_.records()), "damaged chunk: bad_contents");
    }
    default: return unless(is_private(record.opcode), "record of an unknown kind");
  }
}

/// A summary or the footer follows. A damaged opcode may look like the end of the data.
bool SalvageWalk::is_data_end(const Record& record) const {
  if (record.content.size() != sizeof(std::uint32_t)) return false;
  if (record.end() >= source_.size()) return false;
  std::byte opcode{};
  source_.read(record.end(), {&opcode, 1});
  constexpr std::array following{Opcode::footer,     Opcode::schema,           Opcode::channel,       Opcode::chunk_index,
                                 Opcode::statistics, Opcode::attachment_index, Opcode::metadata_index};
  return std::ranges::find(following, static_cast<Opcode>(opcode)) != following.end();
}

void SalvageWalk::resume_after(std::uint64_t begin, std::string what) {
  const std::uint64_t end = find_anchor(begin + 1);
  gaps_.push_back({begin, end, std::move(what)});
  walk_.go_to(end);
}

std::uint64_t SalvageWalk::find_anchor(std::uint64_t from) {
  Buffer window;
  for (std::uint64_t at = from; at < source_.size(); at += window.size()) {
    window.resize(static_cast<std::size_t>(std::min<std::uint64_t>(window_bytes, source_.size() - at)));
    source_.read(at, window);
    for (std::size_t i = 0; i < window.size(); ++i)
      if (may_be_anchor(Bytes(window).subspan(i), source_.size() - at - i) && is_anchor(at + i)) return at + i;
  }
  return source_.size();
}

bool SalvageWalk::is_anchor(std::uint64_t at) {
  FileWalk walk(source_, at, source_.size());
  const auto front = walk.peek(64);
  if (!front) return false;
  if (front->opcode == Opcode::chunk && !is_plausible_chunk(front->content, front->length)) return false;
  const auto record = walk.next();
  if (!record) return false;
  if (record->opcode == Opcode::metadata) return is_exact_metadata(record->content);
  return chunk_.open(record->content) == ChunkDamage::none && are_whole(chunk_.records()) &&
         chunk_.chunk().uncompressed_crc != 0;
}

}  // namespace lbea::mcap
