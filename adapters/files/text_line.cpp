#include "adapters/files/text_line.hpp"

#include <algorithm>

namespace lbea::io::text {
namespace {
constexpr std::size_t longest_number = 64;  // characters, of a number that is copied before it is read
}

bool LineReader::next(std::string_view& line) {
  if (at_ >= text_.size()) return false;
  const std::size_t end = text_.find(end_, at_);
  const std::size_t stop = end == std::string_view::npos ? text_.size() : end;
  line = text_.substr(at_, stop - at_);
  if (line.ends_with('\r')) line.remove_suffix(1);
  at_ = end == std::string_view::npos ? text_.size() : end + 1;
  ++line_;
  return true;
}

void LineReader::fail(const std::string& what, Status status) const {
  const std::string kind = kind_.empty() ? "" : " (" + std::string(kind_) + ")";
  throw Error(status, std::string(name_) + ", line " + std::to_string(line_) + ": " + what + kind);
}

std::string_view without_byte_order_mark(std::string_view text) noexcept {
  constexpr std::string_view mark = "\xef\xbb\xbf";
  return text.substr(text.starts_with(mark) ? mark.size() : 0);
}

std::string_view checked_encoding(std::string_view text, std::string_view name) {
  const auto is_zero = [&](std::size_t at) { return text.size() >= 4 && text[at] == '\0'; };
  const bool is_low_first = is_zero(1) && is_zero(3) && !is_zero(0) && !is_zero(2);
  const bool is_high_first = is_zero(0) && is_zero(2) && !is_zero(1) && !is_zero(3);
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") || is_low_first || is_high_first)
    throw Error(Status::unsupported_input, std::string(name) + ": the text is in UTF-16; save it in UTF-8");
  return without_byte_order_mark(text);
}

std::string quoted(std::string_view word) { return "\"" + std::string(word.substr(0, 40)) + "\""; }

std::string_view trimmed(std::string_view text, std::string_view blanks) noexcept {
  text.remove_prefix(std::min(text.find_first_not_of(blanks), text.size()));
  return text.substr(0, text.find_last_not_of(blanks) + 1);
}

std::string lower(std::string_view text) {
  std::string result(text);
  for (char& c : result) c = is_letter(c) ? static_cast<char>(c | 0x20) : c;
  return result;
}

std::string_view next_word(std::string_view& rest) noexcept {
  std::size_t begin = 0;
  while (begin < rest.size() && is_blank(rest[begin])) ++begin;
  std::size_t end = begin;
  while (end < rest.size() && !is_blank(rest[end])) ++end;
  const std::string_view word = rest.substr(begin, end - begin);
  rest.remove_prefix(end);
  return word;
}

bool Fields::next(std::string_view& field) noexcept {
  if (separator_ == blanks) {
    field = next_word(rest_);
    if (field.empty()) return false;
  } else {
    if (at_end_) return false;
    const std::size_t stop = rest_.find(separator_);
    field = trimmed(rest_.substr(0, stop));
    at_end_ = stop == std::string_view::npos;
    if (!at_end_) rest_.remove_prefix(stop + 1);
  }
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"') field = field.substr(1, field.size() - 2);
  return true;
}

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  Fields reader(line, separator);
  for (std::string_view field; reader.next(field);) fields.push_back(field);
  return fields;
}

bool parse_number(std::string_view word, float& value) noexcept {
  if (word.starts_with('+')) word.remove_prefix(1);
  if (word.empty() || word.front() == '+') return false;
  const char* const end = word.data() + word.size();
  const auto [stop, error] = std::from_chars(word.data(), end, value);
  if (error == std::errc{} && stop == end) return true;
  if (error == std::errc::result_out_of_range && stop == end) {  // outside the range of float, but not of double: 1e-60
    double wide = 0;
    if (std::from_chars(word.data(), end, wide).ec != std::errc{}) return false;
    value = static_cast<float>(wide);
    return true;
  }
  if (error == std::errc{} && (*stop == 'd' || *stop == 'D') && word.size() <= longest_number) {
    std::array<char, longest_number> digits{};
    std::replace_copy(word.begin(), word.end(), digits.begin(), *stop, 'e');
    return parse_number({digits.data(), word.size()}, value);
  }
  if (error != std::errc{} || *stop != '#') return false;  // some run-time libraries print NaN as 1.#QNAN
  value = std::numeric_limits<float>::quiet_NaN();
  return true;
}

bool next_real(std::string_view& rest, double& value) noexcept {
  while (!rest.empty() && is_space(rest.front())) rest.remove_prefix(1);
  const auto [stop, error] = std::from_chars(rest.data(), rest.data() + rest.size(), value);
  if (error == std::errc::result_out_of_range)
    value = std::numeric_limits<double>::quiet_NaN();
  else if (error != std::errc{})
    return false;
  rest.remove_prefix(static_cast<std::size_t>(stop - rest.data()));
  return true;
}

std::optional<std::int64_t> find_stamp(std::string_view comment) noexcept {
  constexpr std::string_view key = "stamp_ns";
  const std::size_t at = comment.find(key);
  if (at == std::string_view::npos) return std::nullopt;
  std::string_view rest = comment.substr(at + key.size());
  const std::size_t digits = rest.find_first_not_of(" \t:=");
  if (digits == std::string_view::npos) return std::nullopt;
  rest.remove_prefix(digits);
  std::int64_t stamp = 0;
  const auto result = std::from_chars(rest.data(), rest.data() + rest.size(), stamp);
  return result.ec == std::errc{} ? std::optional(stamp) : std::nullopt;
}
}  // namespace lbea::io::text
