// Numbers as text and back.
#pragma once

#include <array>
#include <charconv>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lbea::tool {

/// printf into a string. Truncates after 511 characters.
template <typename... Values>
std::string formatted(const char* pattern, Values... values) {
  std::array<char, 512> line{};
  std::snprintf(line.data(), line.size(), pattern, values...);
  return line.data();
}

/// The whole of `text` as a number; nothing when it is anything else or outside the type's range. An integer may have
/// another base than 10.
template <class Number, class... Base>
std::optional<Number> parsed(std::string_view text, Base... base) {
  Number number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number, base...);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

/// The numbers of a list such as "2:30"; nothing when any of them is not a number, and for an empty text.
template <class Number>
std::optional<std::vector<Number>> parsed_list(std::string_view text, char separator) {
  std::vector<Number> numbers;
  for (std::size_t first = 0, end = 0; end != text.npos; first = end + 1) {
    end = text.find(separator, first);
    const auto number = parsed<Number>(text.substr(first, end - first));
    if (!number) return std::nullopt;
    numbers.push_back(*number);
  }
  return numbers;
}

}  // namespace lbea::tool
