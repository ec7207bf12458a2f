// Lines, words and numbers of text files, without copies.
#pragma once

#include <charconv>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string_view>
#include <system_error>

namespace lbea::io::text {

/// Goes through a text line by line; "\n" and "\r\n" end a line.
class LineReader {
 public:
  explicit LineReader(std::string_view text) : text_(text) {}
  /// False at the end of the text.
  bool next(std::string_view& line);
  [[nodiscard]] std::size_t line() const noexcept { return line_; }  // of the line read last, from 1
  [[nodiscard]] std::size_t byte() const noexcept { return at_; }    // where the next line begins
  [[nodiscard]] std::string_view rest() const noexcept { return text_.substr(at_); }

 private:
  std::string_view text_;
  std::size_t at_ = 0;
  std::size_t line_ = 0;
};

[[nodiscard]] constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t'; }
[[nodiscard]] constexpr bool is_space(char c) noexcept { return is_blank(c) || c == '\n' || c == '\r'; }
[[nodiscard]] std::string_view trimmed(std::string_view text) noexcept;

/// Takes the next word (no blanks in it) from the front of `rest`; empty at the end.
std::string_view next_word(std::string_view& rest) noexcept;

/// Goes through the fields of a line.
class Fields {
 public:
  static constexpr char blanks = ' ';  // any run of blanks and tabs separates
  Fields(std::string_view line, char separator) : rest_(line), separator_(separator) {}
  /// False after the last field. Fields come without blanks and quotes around them.
  bool next(std::string_view& field) noexcept;

 private:
  std::string_view rest_;
  char separator_;
  bool at_end_ = false;
};

/// The whole of `word` as a number: decimal point, optional sign, exponent, nan, inf, and the spellings 1.#QNAN
/// and -1.#IND. False when it is anything else or outside double's range.
bool parse_number(std::string_view word, float& value) noexcept;

/// The whole of `word` as an integer; false when it is anything else or outside the type's range.
template <class Integer>
[[nodiscard]] bool parse_integer(std::string_view word, Integer& value) noexcept {
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && stop == word.data() + word.size();
}

/// Skips blanks and line ends, then takes a number from the front of `rest`; NaN for one outside double's range.
/// False when no number stands there.
[[nodiscard]] bool next_real(std::string_view& rest, double& value) noexcept;

/// The number after the word "stamp_ns" in a comment.
[[nodiscard]] std::optional<std::int64_t> find_stamp(std::string_view comment) noexcept;

}  // namespace lbea::io::text
