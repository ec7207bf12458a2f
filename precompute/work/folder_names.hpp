// Lists a folder. The standard library's directory iterators terminate the program when memory runs out (GCC 12), which
// would leave temporary files behind.
#pragma once

#include <cerrno>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

#include <dirent.h>

namespace lbea::bake {

/// Names in `folder`, unordered, without "." and ".."; empty, and `error` set, when it cannot be read.
[[nodiscard]] inline std::vector<std::string> names_in(const std::filesystem::path& folder, std::error_code& error) {
  struct Close {
    void operator()(DIR* open) const noexcept { ::closedir(open); }
  };
  error.clear();
  std::vector<std::string> names;
  const std::unique_ptr<DIR, Close> open(::opendir(folder.c_str()));
  if (open == nullptr && errno == ENOMEM) throw std::bad_alloc();
  if (open == nullptr) error.assign(errno, std::generic_category());
  while (const dirent* const entry = open == nullptr ? nullptr : ::readdir(open.get()))
    if (const std::string_view name = entry->d_name; name != "." && name != "..") names.emplace_back(name);
  return names;
}

}  // namespace lbea::bake
