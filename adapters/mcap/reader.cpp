#include "adapters/mcap/reader.hpp"

#include <limits>

namespace lbea::mcap {
namespace {
constexpr std::array<std::string_view, 7> damage_names{
    "none", "bad_record", "unknown_compression", "bad_compression", "wrong_crc", "bad_contents", "too_large"};
constexpr std::uint64_t largest_decompressed = std::uint64_t{512} << 20;  // above the largest frame

template <class Known, class Item>
bool same_or_new(Known& known, Item& item) {
  const auto id = item.id;
  const auto [place, is_new] = known.try_emplace(id, std::move(item));
  return is_new || place->second == item;  // try_emplace does not move from `item` when the id is known
}
}  // namespace

std::optional<Record> FileReader::next() {
  const auto found = peek(std::numeric_limits<std::size_t>::max());
  if (found) position_ = found->end();
  return found;
}

std::optional<Record> FileReader::peek(std::size_t most) {
  if (end_ < position_ || end_ - position_ < record_prefix_bytes) return std::nullopt;
  std::array<std::byte, record_prefix_bytes> prefix{};
  source_.read(position_, prefix);
  ByteCursor cursor(prefix);
  const auto opcode = cursor.number<Opcode>();
  const auto length = cursor.number<std::uint64_t>();
  if (opcode == Opcode{} || length > end_ - position_ - record_prefix_bytes) return std::nullopt;
  buffer_.resize(static_cast<std::size_t>(std::min<std::uint64_t>(length, most)));
  source_.read(position_ + record_prefix_bytes, buffer_);
  return Record{opcode, position_, length, buffer_};
}

std::optional<Record> next_record(Bytes& rest, std::uint64_t& offset) {
  ByteCursor cursor(rest);
  const auto opcode = cursor.number<Opcode>();
  const Bytes content = cursor.long_block();
  if (!cursor.intact() || opcode == Opcode{}) return std::nullopt;
  const Record record{opcode, offset, content.size(), content};
  rest = rest.subspan(record_prefix_bytes + content.size());
  offset = record.end();
  return record;
}

std::string_view to_string(ChunkDamage damage) noexcept { return damage_names[static_cast<std::size_t>(damage)]; }

ChunkDamage OpenChunk::open(Bytes content) {
  records_ = {};
  auto chunk = parse<Chunk>(content);
  if (!chunk) return ChunkDamage::bad_record;
  chunk_ = std::move(*chunk);
  const auto compression = compression_named(chunk_.compression);
  if (!compression) return ChunkDamage::unknown_compression;
  Bytes records = chunk_.records;
  if (*compression != Compression::none) {
    if (chunk_.uncompressed_size > std::min(largest_decompressed, budget_)) return ChunkDamage::too_large;
    budget_ -= chunk_.uncompressed_size;
    if (!decompress(*compression, records, chunk_.uncompressed_size, decompressed_))
      return ChunkDamage::bad_compression;
    records = decompressed_;
  }
  if (records.size() != chunk_.uncompressed_size) return ChunkDamage::bad_record;
  if (chunk_.uncompressed_crc != 0 && crc32(records) != chunk_.uncompressed_crc) return ChunkDamage::wrong_crc;
  records_ = records;
  return ChunkDamage::none;
}

bool Definitions::add(const Record& record) {
  if (record.opcode == Opcode::schema) {
    auto schema = parse<Schema>(record.content);
    return schema && same_or_new(schemas, *schema);
  }
  if (record.opcode == Opcode::channel) {
    auto channel = parse<Channel>(record.content);
    return channel && same_or_new(channels, *channel);
  }
  return true;
}

bool are_whole(Bytes records) {
  std::uint64_t offset = 0;
  while (!records.empty()) {
    const auto record = next_record(records, offset);
    if (!record) return false;
    if (record->opcode == Opcode::message && !parse<Message>(record->content)) return false;
  }
  return true;
}
}  // namespace lbea::mcap
