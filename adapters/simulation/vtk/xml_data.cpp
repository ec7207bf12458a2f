#include "adapters/simulation/vtk/xml_data.hpp"

#include <lbea/lbea.hpp>

#include <lz4.h>
#include <zlib.h>

#include <algorithm>

#include "adapters/files/text_line.hpp"

namespace lbea::io::grid {
namespace {
using binary::plus;
using binary::Scalar;
using binary::times;

constexpr std::uint64_t densest = 1100;  // no compressor here reaches this ratio, so a larger one means damage

[[noreturn]] void fail(const std::string& what, const std::string& why) {
  throw Error{Status::bad_input, what + ": " + why + "; the file is damaged or cut short, export it again"};
}

int digit_of(char c) noexcept {
  if (c >= 'A' && c <= 'Z') return c - 'A';
  if (c >= 'a' && c <= 'z') return c - 'a' + 26;
  if (c >= '0' && c <= '9') return c - '0' + 52;
  return c == '+' ? 62 : c == '/' ? 63 : -1;
}

/// Decodes the first bytes of a block, `most` and at most two more. Each group of four characters is decoded by itself,
/// because a block may consist of several encoded parts with padding between them.
std::vector<std::byte> decode_base64(std::string_view text, std::uint64_t most) {
  std::vector<std::byte> bytes;
  bytes.reserve(std::min<std::uint64_t>(most, text.size()) + 3);
  for (std::size_t at = 0; at + 4 <= text.size() && bytes.size() < most; at += 4) {
    std::uint32_t group = 0;
    std::size_t digits = 0;
    for (; digits < 4; ++digits) {
      const int digit = digit_of(text[at + digits]);
      if (digit < 0) break;
      group |= static_cast<std::uint32_t>(digit) << (18 - 6 * digits);
    }
    if (digits < 2) break;
    for (std::size_t i = 0; i + 1 < digits; ++i) bytes.push_back(static_cast<std::byte>(group >> (16 - 8 * i)));
  }
  return bytes;
}

/// Decodes a block as far as needed.
class Block {
 public:
  Block(std::string_view text, bool is_raw, const std::string& what) : text_(text), is_raw_(is_raw), what_(what) {}

  std::span<const std::byte> first(std::uint64_t bytes) {
    if (bytes > text_.size()) fail(what_, "its data end early");
    if (is_raw_) return std::as_bytes(std::span(text_)).first(bytes);
    if (decoded_.size() < bytes) decoded_ = decode_base64(text_, bytes);
    if (decoded_.size() < bytes) fail(what_, "its data end early");
    return std::span<const std::byte>(decoded_).first(bytes);
  }

 private:
  std::string_view text_;
  bool is_raw_;
  const std::string& what_;
  std::vector<std::byte> decoded_;
};

bool decompress(Compressor compressor, std::span<const std::byte> from, std::span<std::byte> into) {
  if (compressor == Compressor::lz4) {
    constexpr auto most = static_cast<std::size_t>(std::numeric_limits<int>::max());
    if (from.size() > most || into.size() > most) return false;
    return LZ4_decompress_safe(reinterpret_cast<const char*>(from.data()), reinterpret_cast<char*>(into.data()),
                               static_cast<int>(from.size()),
                               static_cast<int>(into.size())) == static_cast<int>(into.size());
  }
  uLongf size = into.size();
  return uncompress(reinterpret_cast<Bytef*>(into.data()), &size, reinterpret_cast<const Bytef*>(from.data()),
                    from.size()) == Z_OK &&
         size == into.size();
}

/// Header: number of parts, decompressed size of each, of the last one when it is smaller, compressed size of each.
std::vector<std::byte> decompressed(Block& block, const XmlStorage& storage, std::uint64_t size,
                                    const std::string& what) {
  const std::size_t h = storage.header_bytes;
  const auto number = [&](std::uint64_t i) {
    return binary::load_bits(block.first((i + 1) * h).data() + i * h, h, storage.is_big_endian);
  };
  const std::uint64_t parts = number(0);
  if (parts == 0 && size == 0) return {};
  const std::uint64_t part_size = number(1), last_size = number(2);
  const std::uint64_t full = last_size == 0 ? parts : parts - 1;
  if (parts == 0 || plus(times(full, part_size), last_size) != size) fail(what, "its size does not match its values");
  const std::uint64_t header = times(plus(parts, 3), h);
  const auto counts = block.first(header);
  std::vector<std::uint64_t> ends{header};
  for (std::uint64_t i = 0; i < parts; ++i)
    ends.push_back(plus(ends.back(), binary::load_bits(counts.data() + (3 + i) * h, h, storage.is_big_endian)));
  const auto bytes = block.first(ends.back());
  if (size / densest > bytes.size()) fail(what, "its declared size is too large for its compressed data");
  std::vector<std::byte> result(size);
  std::uint64_t at = 0;
  for (std::size_t i = 0; i < parts; ++i) {
    const std::uint64_t part = std::min(part_size, size - at);
    if (!decompress(storage.compressor, bytes.subspan(ends[i], ends[i + 1] - ends[i]),
                    std::span(result).subspan(at, part)))
      fail(what, "its data cannot be decompressed");
    at += part;
  }
  return result;
}
}  // namespace

std::optional<Scalar> xml_type(std::string_view name) {
  constexpr std::array<std::pair<std::string_view, Scalar>, 10> types{{
      {"Int8", Scalar::int8},
      {"UInt8", Scalar::uint8},
      {"Int16", Scalar::int16},
      {"UInt16", Scalar::uint16},
      {"Int32", Scalar::int32},
      {"UInt32", Scalar::uint32},
      {"Int64", Scalar::int64},
      {"UInt64", Scalar::uint64},
      {"Float32", Scalar::float32},
      {"Float64", Scalar::float64},
  }};
  for (const auto& [known, type] : types)
    if (known == name) return type;
  return std::nullopt;
}

std::vector<double> text_values(std::string_view rest, std::uint64_t count, const std::string& what) {
  if (count > rest.size() / 2 + 1) fail(what, "it has fewer than " + std::to_string(count) + " values");
  std::vector<double> values(count);
  for (double& value : values)
    if (!text::next_real(rest, value)) fail(what, "it has fewer than " + std::to_string(count) + " values");
  return values;
}

std::vector<double> block_values(std::string_view text, bool is_raw, const XmlStorage& storage, binary::Scalar type,
                                 std::uint64_t count, const std::string& what) {
  Block block(text, is_raw, what);
  const std::size_t size = binary::size_of(type);
  std::vector<std::byte> decompressed_bytes;
  std::span<const std::byte> bytes;
  if (storage.compressor != Compressor::none) {
    decompressed_bytes = decompressed(block, storage, times(count, size), what);
    bytes = decompressed_bytes;
  } else {
    const std::size_t h = storage.header_bytes;
    if (binary::load_bits(block.first(h).data(), h, storage.is_big_endian) != times(count, size))
      fail(what, "its size does not match its values");
    bytes = block.first(plus(h, times(count, size))).subspan(h);
  }
  std::vector<double> values(count);
  for (std::size_t i = 0; i < values.size(); ++i)
    values[i] = binary::load(bytes.data() + i * size, type, storage.is_big_endian);
  return values;
}
}  // namespace lbea::io::grid
