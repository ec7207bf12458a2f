// Lines, words and numbers of text files, without copies.
#pragma once

#include <lbea/lbea.hpp>

#include <charconv>
#include <optional>
#include <system_error>

namespace lbea::io::text {
/// Reads a text line by line; "\n" and "\r\n" end a line, in a text without "\n" also "\r".
class LineReader {
 public:
  /// For messages: the file's `name` and `kind`, and how many of its lines stand before `text`.
  explicit LineReader(std::string_view text, std::string_view name = {}, std::string_view kind = {},
                      std::size_t lines_before = 0)
      : text_(text),
        name_(name),
        kind_(kind),
        end_(text.find('\n') == std::string_view::npos ? '\r' : '\n'),
        line_(lines_before) {}
  /// False at the end of the text.
  bool next(std::string_view& line);
  [[nodiscard]] std::size_t line() const noexcept { return line_; }  // number of the last line read, from 1
  [[nodiscard]] std::size_t byte() const noexcept { return at_; }    // where the next line begins
  [[nodiscard]] std::string_view rest() const noexcept { return text_.substr(at_); }
  /// Throws Error "NAME, line N: WHAT (KIND)".
  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const;

 private:
  std::string_view text_, name_, kind_;
  char end_;
  std::size_t at_ = 0, line_;
};

[[nodiscard]] constexpr bool is_blank(char c) noexcept { return c == ' ' || c == '\t'; }
[[nodiscard]] constexpr bool is_digit(char c) noexcept { return c >= '0' && c <= '9'; }
[[nodiscard]] constexpr bool is_letter(char c) noexcept { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }
[[nodiscard]] constexpr bool is_space(char c) noexcept { return is_blank(c) || c == '\n' || c == '\r'; }
[[nodiscard]] std::string_view trimmed(std::string_view text, std::string_view blanks = " \t") noexcept;

/// `text` without the mark of UTF-8 that some programs write first.
[[nodiscard]] std::string_view without_byte_order_mark(std::string_view text) noexcept;
/// The same; throws Error that names the file when the text is in UTF-16, also without a mark.
[[nodiscard]] std::string_view checked_encoding(std::string_view text, std::string_view name);
/// The first 40 characters between quotes, for messages.
[[nodiscard]] std::string quoted(std::string_view word);
/// `text` with the letters A to Z in lower case.
[[nodiscard]] std::string lower(std::string_view text);

/// Takes the next word (no blanks in it) from the front of `rest`; empty at the end.
std::string_view next_word(std::string_view& rest) noexcept;

/// Reads the fields of a line.
class Fields {
 public:
  static constexpr char blanks = ' ';  // any run of blanks and tabs separates
  Fields(std::string_view line, char separator) : rest_(line), separator_(separator) {}
  /// False after the last field. Blanks and quotes around a field are removed.
  bool next(std::string_view& field) noexcept;

 private:
  std::string_view rest_;
  char separator_;
  bool at_end_ = false;
};

/// All fields of a line.
[[nodiscard]] std::vector<std::string_view> split(std::string_view line, char separator);

/// The whole of `word` as a number: decimal point, optional sign, exponent (also Fortran's "1d3"), nan, inf, and the
/// spellings 1.#QNAN and -1.#IND. False when it is anything else or outside double's range.
bool parse_number(std::string_view word, float& value) noexcept;

/// The whole of `word` as an integer; false when it is anything else or outside the type's range.
template <class Integer>
[[nodiscard]] bool parse_integer(std::string_view word, Integer& value) noexcept {
  const auto [stop, error] = std::from_chars(word.data(), word.data() + word.size(), value);
  return error == std::errc{} && stop == word.data() + word.size();
}

/// Skips blanks and line ends, then takes a number from the front of `rest`; NaN for one outside double's range.
/// False when it does not begin with one.
[[nodiscard]] bool next_real(std::string_view& rest, double& value) noexcept;

/// The number after the word "stamp_ns" in a comment.
[[nodiscard]] std::optional<std::int64_t> find_stamp(std::string_view comment) noexcept;
}  // namespace lbea::io::text
