#include "runtime/src/model/section_content.hpp"

#include "runtime/src/model/checksum.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace lbea {
namespace {
using format::ElementType;

// Without the sign, the bits of floating-point numbers have the order of the values; infinity and NaN are the largest.
template <typename Float, typename Word>
bool all_measured(std::span<const std::byte> bytes) noexcept {
  constexpr Word magnitude = static_cast<Word>(~Word{0} >> 1),
                 largest = std::bit_cast<Word>(static_cast<Float>(format::largest_measure));
  bool is_measured = true;
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(Word)) {
    Word word;
    std::memcpy(&word, &bytes[at], sizeof(word));
    is_measured &= (word & magnitude) <= largest;
  }
  return is_measured;
}

std::uint32_t greatest_of(std::span<const std::byte> bytes, std::uint32_t greatest) noexcept {
  for (std::size_t at = 0; at < bytes.size(); at += sizeof(greatest)) {
    std::uint32_t word;
    std::memcpy(&word, &bytes[at], sizeof(word));
    greatest = std::max(greatest, word);
  }
  return greatest;
}

void inspect(std::span<const std::byte> bytes, format::ElementType type, SectionContent& content) noexcept {
  if (type == ElementType::f32) content.is_measured &= all_measured<float, std::uint32_t>(bytes);
  if (type == ElementType::f64) content.is_measured &= all_measured<double, std::uint64_t>(bytes);
  if (type == ElementType::u32) content.greatest = greatest_of(bytes, content.greatest);
}
}  // namespace

std::uint64_t checksum_of(std::span<const std::byte> bytes) noexcept { return checksum(bytes); }

SectionContent content_of(std::span<const std::byte> section, ElementType type, const Release& release) {
  constexpr std::size_t piece_size = std::size_t{1} << 20;  // stays in the cache between checksum and inspection
  SectionContent content;
  RunningChecksum checksum;
  for (std::size_t begin = 0; begin < section.size(); begin += piece_size) {
    const auto piece = section.subspan(begin, std::min(piece_size, section.size() - begin));
    checksum.add(piece);
    inspect(piece, type, content);
    if (release) release(piece);
  }
  content.checksum = checksum.value();
  return content;
}
}  // namespace lbea
