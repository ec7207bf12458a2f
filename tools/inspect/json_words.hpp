// A JSON value as words for a table: strings without their quotes.
#pragma once

#include <nlohmann/json.hpp>

#include <string>

namespace lbea::tool {

inline std::string text(const nlohmann::ordered_json& json) {
  using Json = nlohmann::ordered_json;
  return json.is_string() ? json.get<std::string>() : json.dump(-1, ' ', false, Json::error_handler_t::replace);
}

}  // namespace lbea::tool
