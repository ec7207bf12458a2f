// Names of the methods on command lines and in recordings.
#pragma once

#include <lbea/lbea.hpp>

#include <map>

namespace lbea::tool {

inline const std::map<std::string, Method> method_names{
    {"lbea", Method::lbea}, {"vtp", Method::vtp}, {"fit", Method::fit}};

[[nodiscard]] inline std::string name_of(Method method) {
  for (const auto& [name, value] : method_names)
    if (value == method) return name;
  return "unknown";
}

}  // namespace lbea::tool
