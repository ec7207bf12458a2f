#include "precompute/model_file/json_text.hpp"

#include <array>
#include <charconv>
#include <cmath>

namespace lbea::bake {

std::string json_string(std::string_view text) {
  constexpr std::string_view digits = "0123456789abcdef";
  std::string json = "\"";
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (c == '"' || c == '\\')
      json.append({'\\', c});
    else if (byte < 0x20)
      json.append("\\u00").append({digits[byte / 16], digits[byte % 16]});
    else
      json.push_back(c);
  }
  return json + '"';
}

std::string json_number(double number) {
  if (!std::isfinite(number)) return "null";
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), number).ptr;
  return {text.data(), end};
}

std::string json_array(const std::vector<std::string>& values) {
  std::string json;
  for (const std::string& value : values) json += (json.empty() ? "" : ",") + value;
  return "[" + json + "]";
}

JsonObject& JsonObject::add(std::string_view key, const std::string& value) {
  members_ += (members_.empty() ? "" : ",") + json_string(key) + ":" + value;
  return *this;
}

}  // namespace lbea::bake
