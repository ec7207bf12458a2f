#include "tools/shared/text/printable.hpp"

#include <array>
#include <cstdint>

namespace lbea::tool {
namespace {

struct Character {
  std::size_t bytes = 1;
  bool is_shown = false;
};

std::uint32_t byte_at(std::string_view text, std::size_t i) { return static_cast<unsigned char>(text[i]); }

constexpr bool is_control(std::uint32_t code) {
  const bool turns_writing = (code >= 0x202A && code <= 0x202E) || (code >= 0x2066 && code <= 0x2069);
  return code < 0x20 || (code >= 0x7F && code <= 0x9F) || turns_writing;
}

/// The first character. Overlong forms, surrogates and broken sequences are single bytes that are not shown.
Character first_of(std::string_view text) {
  constexpr std::array<std::uint32_t, 5> least{0, 0, 0x80, 0x800, 0x10000};
  const std::uint32_t lead = byte_at(text, 0);
  if (lead < 0x80) return {1, !is_control(lead)};
  const std::size_t bytes = lead >= 0xF0 ? 4 : lead >= 0xE0 ? 3 : 2;
  if (lead < 0xC2 || lead > 0xF4 || text.size() < bytes) return {};
  std::uint32_t code = lead & (0x7Fu >> bytes);
  for (std::size_t i = 1; i < bytes; ++i) {
    if ((byte_at(text, i) & 0xC0) != 0x80) return {};
    code = code << 6 | (byte_at(text, i) & 0x3F);
  }
  const bool is_valid = code >= least[bytes] && code <= 0x10FFFF && (code < 0xD800 || code > 0xDFFF);
  return is_valid ? Character{bytes, !is_control(code)} : Character{};
}

}  // namespace

std::string printable(std::string_view text, std::string_view kept) {
  std::string shown;
  while (!text.empty()) {
    const Character character = first_of(text);
    if (character.is_shown || kept.find(text[0]) != std::string_view::npos) {
      shown += text.substr(0, character.bytes);
    } else {
      for (std::size_t i = 0; i < character.bytes; ++i) {
        constexpr std::string_view digits = "0123456789abcdef";
        shown += {'\\', 'x', digits[byte_at(text, i) >> 4], digits[byte_at(text, i) & 15]};
      }
    }
    text.remove_prefix(character.bytes);
  }
  return shown;
}

}  // namespace lbea::tool
