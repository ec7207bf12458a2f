// printf into a string.
#pragma once

#include <array>
#include <cstdio>
#include <string>

namespace lbea::tool {

/// Truncates after 511 characters.
template <typename... Values>
std::string formatted(const char* pattern, Values... values) {
  std::array<char, 512> line{};
  std::snprintf(line.data(), line.size(), pattern, values...);
  return line.data();
}

}  // namespace lbea::tool
