#include "tools/report/page/html.hpp"

#include "tools/shared/text/formatted.hpp"
#include "tools/shared/text/printable.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace lbea::tool {
namespace {

constexpr std::string_view dash = "\u2013";

std::string base64(std::string_view bytes) {
  constexpr std::string_view digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    std::uint32_t three = 0;
    for (std::size_t k = 0; k < 3; ++k)
      three = three << 8 | (k < count ? static_cast<unsigned char>(bytes[i + k]) : 0u);
    for (std::size_t k = 0; k < 4; ++k) text += k <= count ? digits[three >> (18 - 6 * k) & 63u] : '=';
  }
  return text;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string safe;
  for (const char c : printable(text)) {
    if (c == '&')
      safe += "&amp;";
    else if (c == '<')
      safe += "&lt;";
    else if (c == '>')
      safe += "&gt;";
    else if (c == '"')
      safe += "&quot;";
    else if (c == '\'')
      safe += "&#39;";
    else
      safe += c;
  }
  return safe;
}

std::string number_text(double value, int digits) {
  if (!std::isfinite(value)) return std::string(dash);
  if (value == 0) return "0";
  constexpr int most_decimals = 6, most_places = 7;
  const int place = static_cast<int>(std::floor(std::log10(std::abs(value))));  // of the first digit
  if (place < -most_decimals || place >= most_places) return formatted("%.*g", digits, value);
  return formatted("%.*f", std::clamp(digits - 1 - place, 0, most_decimals), value);
}

std::string interval_text(double value, double half_width) {
  if (!std::isfinite(value) || !(half_width > 0) || !std::isfinite(half_width)) return number_text(value);
  constexpr int digits = 2, most_decimals = 6;  // of the half width
  const int decimals = std::clamp(digits - 1 - static_cast<int>(std::floor(std::log10(half_width))), 0, most_decimals);
  return formatted("%.*f \u00b1 %.*f", decimals, value, decimals, half_width);
}

std::string percent_text(double share) {
  if (!std::isfinite(share)) return std::string(dash);
  constexpr double nearly_all = 0.995, nearly_none = 0.005;
  if (share >= nearly_all) return "more than 99 %";
  if (share < nearly_none) return "less than 1 %";
  return formatted("%.0f %%", 100 * share);
}

std::string number_cell(const std::string& html) { return "<td class=\"number\">" + html + "</td>"; }
std::string number_head(const std::string& html) { return "<th scope=\"col\" class=\"number\">" + html + "</th>"; }

std::string shell_word(std::string_view text) {
  constexpr std::string_view plain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-./:=+,@%";
  if (!text.empty() && text.find_first_not_of(plain) == text.npos) return std::string(text);
  std::string word = "'";
  for (const char c : text) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + '\'';
}

std::string data_url(const io::Picture& picture) { return "data:image/png;base64," + base64(io::png_of(picture)); }

}  // namespace lbea::tool
