// Values as text for tables.
#pragma once

#include <nlohmann/json.hpp>

#include <array>
#include <cstdint>
#include <cstdio>
#include <string>

namespace lbea::tool {

/// For checksums and sessions.
inline std::string hexadecimal(std::uint64_t number) {
  std::array<char, 17> text{};
  std::snprintf(text.data(), text.size(), "%016llx", static_cast<unsigned long long>(number));
  return text.data();
}

/// Strings without quotes.
inline std::string text(const nlohmann::ordered_json& json) {
  using Json = nlohmann::ordered_json;
  return json.is_string() ? json.get<std::string>() : json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lbea::tool
