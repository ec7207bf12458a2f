#include "adapters/export/xml_text.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <charconv>

namespace lbea::io {

std::string xml_quoted(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (static_cast<unsigned char>(c) < 0x20)
      throw Error(Status::bad_config, "a name with a control character cannot be written to XML: rename it");
    if (c == '&')
      quoted += "&amp;";
    else if (c == '<')
      quoted += "&lt;";
    else if (c == '>')
      quoted += "&gt;";
    else if (c == '"')
      quoted += "&quot;";
    else
      quoted += c;
  }
  return quoted + '"';
}

std::string xml_number(double value) {
  std::array<char, 32> digits{};
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), value).ptr;
  return {digits.data(), end};
}

}  // namespace lbea::io
