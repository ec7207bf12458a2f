// Names of table columns for quantities of interest.
#pragma once

#include <string>

namespace lbea::tool {

/// "NAME KIND [UNIT]", without what is empty.
[[nodiscard]] inline std::string channel_column(std::string name, const std::string& kind, const std::string& unit) {
  if (!kind.empty()) name += " " + kind;
  return unit.empty() ? name : name + " [" + unit + "]";
}

}  // namespace lbea::tool
