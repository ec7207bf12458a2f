// Names of files as text.
#pragma once

#include <filesystem>
#include <string_view>

namespace lbea::io {
/// The path with this name, which is in UTF-8 on every system, as is what path::string() returns. The constructor of
/// std::filesystem::path takes a std::string as Latin-1 on Windows.
[[nodiscard]] inline std::filesystem::path path_of(std::string_view name) {
  return std::u8string_view(reinterpret_cast<const char8_t*>(name.data()), name.size());
}
}  // namespace lbea::io
