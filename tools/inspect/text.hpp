// Values as text for tables.
#pragma once

#include "tools/shared/cli/formatted.hpp"
#include "tools/shared/cli/printable.hpp"

#include <nlohmann/json.hpp>

#include <cstdint>

namespace lbea::tool {

/// For checksums and sessions.
inline std::string hexadecimal(std::uint64_t number) {
  return formatted("%016llx", static_cast<unsigned long long>(number));
}

/// Strings without quotes and control characters.
inline std::string text(const nlohmann::ordered_json& json) {
  using Json = nlohmann::ordered_json;
  return printable(json.is_string() ? json.get<std::string>()
                                    : json.dump(-1, ' ', false, Json::error_handler_t::replace));
}

}  // namespace lbea::tool
