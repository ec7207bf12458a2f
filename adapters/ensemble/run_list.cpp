#include "adapters/ensemble/run_list.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <cerrno>

#include <fnmatch.h>
#include <glob.h>

namespace lbea::io {
namespace {

struct GlobResult {
  glob_t value{};
  GlobResult() = default;
  GlobResult(const GlobResult&) = delete;
  GlobResult& operator=(const GlobResult&) = delete;
  ~GlobResult() { globfree(&value); }
};

/// The folder's own name may hold signs of a pattern.
std::string literal(const std::string& path) {
  std::string text;
  for (const char c : path) {
    if (c == '*' || c == '?' || c == '[' || c == ']' || c == '\\') text += '\\';
    text += c;
  }
  return text;
}

std::filesystem::path without_trailing_slash(const std::filesystem::path& path) {
  return path.has_filename() ? path : path.parent_path();
}

}  // namespace

std::vector<std::filesystem::path> matching_paths(const std::filesystem::path& folder, const std::string& pattern) {
  const bool is_absolute = std::filesystem::path(pattern).is_absolute();
  const std::string base = is_absolute || folder.empty() ? "" : literal(folder.string()) + "/";
  GlobResult found;
  const auto stops = [](const char*, int error) {
    return error == ENOENT ? 0 : 1;
  };  // what is not there matches nothing
  const int outcome = ::glob((base + pattern).c_str(), GLOB_NOSORT, stops, &found.value);
  if (outcome != 0 && outcome != GLOB_NOMATCH)
    throw Error(Status::bad_input, "cannot look through the folders of \"" + pattern + "\" in " +
                                       (folder.empty() ? "." : folder.string()) + "; check their rights");
  std::vector<std::filesystem::path> paths;
  for (std::size_t i = 0; i < found.value.gl_pathc; ++i)
    paths.push_back(without_trailing_slash(std::filesystem::path(found.value.gl_pathv[i]).lexically_normal()));
  std::sort(paths.begin(), paths.end());  // by bytes, not by the locale
  return paths;
}

bool means_run(const std::string& name, const std::filesystem::path& folder, const std::filesystem::path& run) {
  const auto matches = [&](const std::filesystem::path& path) {
    return ::fnmatch(path.c_str(), run.c_str(), FNM_PATHNAME) == 0 || path == run;
  };
  if (matches(without_trailing_slash((literal(folder.string()) / std::filesystem::path(name)).lexically_normal())))
    return true;
  return ::fnmatch(name.c_str(), run.filename().c_str(), FNM_PATHNAME) == 0;
}

}  // namespace lbea::io
