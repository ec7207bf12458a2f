#include "adapters/simulation/keyword/cards.hpp"

#include <algorithm>

namespace lbea::io::keyword {
std::string in_capitals(std::string_view text) {
  std::string result(text);
  std::transform(result.begin(), result.end(), result.begin(),
                 [](char c) { return text::is_letter(c) ? static_cast<char>(c & ~0x20) : c; });
  return result;
}

bool Cards::next_keyword(std::string& keyword) {
  for (std::string_view line; lines_.next(line);) {
    if (!line.starts_with('*')) continue;
    const std::string capitals = in_capitals(line);
    if (capitals.starts_with("*END")) return false;
    read_widths(capitals, keyword);
    return true;
  }
  return false;
}

void Cards::read_widths(std::string_view line, std::string& keyword) {
  std::string_view rest = line;
  keyword = text::next_word(rest);
  if (keyword == "*KEYWORD") {
    if (line.find("LONG=Y") != std::string_view::npos) general_ = {20, 20};
    if (line.find("I10=Y") != std::string_view::npos) general_.integer = 10;
  }
  widths_ = general_;
  for (; std::string_view("+%-").find(keyword.back()) != std::string_view::npos;
       keyword.pop_back()) {  // ends at the '*'
    if (keyword.back() == '+') widths_ = {20, 20};
    if (keyword.back() == '%') widths_.integer = 10;
    if (keyword.back() == '-') widths_ = {};
  }
}

bool Cards::next(std::string_view& line) {
  do {
    if (lines_.rest().starts_with('*') || !lines_.next(line)) return false;
  } while (line.starts_with('$'));
  return true;
}

std::vector<std::string_view> Cards::split(std::string_view line, std::size_t integers, std::size_t reals,
                                           Widths widths) {
  if (line.find(',') != std::string_view::npos) return text::split(line, ',');
  std::vector<std::string_view> result;
  for (std::size_t i = 0, at = 0; i < integers + reals && at < line.size(); ++i) {
    const std::size_t width = i < integers ? widths.integer : widths.real;
    result.push_back(text::trimmed(line.substr(at, width)));
    at += width;
  }
  return result;
}

std::uint32_t Cards::id(std::string_view field) const {
  std::uint32_t value = 0;
  if (!text::parse_integer(field, value)) fail(text::quoted(field) + " is not an id");
  return value;
}

float Cards::number(std::string_view field) const {
  float value = 0;
  if (!field.empty() && !text::parse_number(field, value)) fail("\"" + std::string(field) + "\" is not a number");
  return value;
}
}  // namespace lbea::io::keyword
