// What the reports share: formatted lines, and files that are whole or not there.
#pragma once

#include "adapters/files/atomic_file.hpp"

#include <array>
#include <cstdio>
#include <filesystem>
#include <span>
#include <string>

namespace lbea::tool {

/// printf into a string, cut after 511 characters.
template <typename... Values>
std::string formatted(const char* pattern, Values... values) {
  std::array<char, 512> line{};
  std::snprintf(line.data(), line.size(), pattern, values...);
  return line.data();
}

inline void write_text(const std::filesystem::path& path, const std::string& text) {
  io::AtomicFile file(path);
  file.write(std::as_bytes(std::span(text)));
  file.commit();
}

}  // namespace lbea::tool
