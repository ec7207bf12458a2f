#include "adapters/simulation/d3plot/d3plot_encoding.hpp"

#include <array>
#include <cstring>

namespace lbea::io::d3plot {
namespace {

std::int64_t integer_at(std::span<const std::byte> bytes, std::uint64_t word, Encoding encoding) {
  std::array<std::byte, 8> raw{};
  const auto from = bytes.subspan(word * encoding.word_bytes, encoding.word_bytes);
  for (std::size_t i = 0; i < from.size() && i < raw.size(); ++i)
    raw[i] = from[encoding.is_big_endian ? from.size() - 1 - i : i];
  if (encoding.word_bytes == 8) {
    std::int64_t value = 0;
    std::memcpy(&value, raw.data(), sizeof value);
    return value;
  }
  std::int32_t value = 0;
  std::memcpy(&value, raw.data(), sizeof value);
  return value;
}

}  // namespace

std::optional<Encoding> detect_encoding(const WordFile& file) {
  std::array<std::byte, base_words * 8> start{};
  for (const Encoding encoding : {Encoding{4, false}, {8, false}, {4, true}, {8, true}}) {
    const std::span bytes = std::span(start).first(base_words * encoding.word_bytes);
    if (file.bytes() < bytes.size()) continue;
    file.read(0, bytes, "the control words");
    const std::int64_t type = integer_at(bytes, file_type_word, encoding) % wide_ids;
    const std::int64_t dimensions = integer_at(bytes, dimensions_word, encoding);
    if ((type == type_d3plot || type == type_d3part || type == type_d3eigv) && dimensions >= 2 && dimensions <= 9)
      return encoding;
  }
  return std::nullopt;
}

}  // namespace lbea::io::d3plot
