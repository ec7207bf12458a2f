#include "adapters/simulation/open.hpp"

#include "precompute/work/stale_files.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <map>
#include <tuple>

namespace lbea::io {
namespace {
namespace fs = std::filesystem;

struct NumberedName {
  std::string prefix, digits, extension;

  [[nodiscard]] auto series() const { return std::pair(prefix, extension); }
  /// Compares by value, ignoring leading zeros.
  [[nodiscard]] auto order() const {
    const std::size_t first = std::min(digits.find_first_not_of('0'), digits.size());
    return std::tuple(digits.size() - first, digits.substr(first), digits.size());
  }
};

NumberedName split(const fs::path& file) {
  const std::string stem = file.stem().string();
  const std::size_t last = stem.find_last_not_of("0123456789");
  const std::size_t digits = last == std::string::npos ? 0 : last + 1;
  return {stem.substr(0, digits), stem.substr(digits), file.extension().string()};
}

std::vector<fs::path> files_in(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code error;
  for (const std::string& name : bake::names_in(folder, error))
    if (std::error_code ignored; fs::is_regular_file(folder / name, ignored)) files.push_back(folder / name);
  std::sort(files.begin(), files.end());
  return files;
}
}  // namespace

std::vector<fs::path> find_series(const fs::path& file) {
  std::error_code error;
  if (!fs::is_regular_file(file, error))
    throw Error{Status::file_not_found, file.string() + " is not a file that can be read; check the path"};
  const NumberedName name = split(file);
  if (name.digits.empty()) return {file};
  std::vector<fs::path> series;
  for (const fs::path& other : files_in(file.has_parent_path() ? file.parent_path() : "."))
    if (const NumberedName its = split(other); !its.digits.empty() && its.series() == name.series())
      series.push_back(file.has_parent_path() ? other : other.filename());
  std::sort(series.begin(), series.end(),
            [](const fs::path& a, const fs::path& b) { return split(a).order() < split(b).order(); });
  return series;
}

std::string series_name(const fs::path& file) {
  std::error_code error;
  const NumberedName name = split(file);
  if (name.digits.empty() || !fs::is_regular_file(file, error)) return "";
  return (fs::absolute(file).lexically_normal().parent_path() / name.prefix).string() + '/' + name.extension;
}

std::vector<fs::path> first_files(const fs::path& folder) {
  std::map<std::tuple<std::string, std::string, bool>, fs::path> first;
  for (const fs::path& file : files_in(folder)) {
    const NumberedName name = split(file);
    const auto [at, is_new] = first.emplace(std::tuple(name.prefix, name.extension, name.digits.empty()), file);
    if (!is_new && name.order() < split(at->second).order()) at->second = file;
  }
  std::vector<fs::path> files;
  for (const auto& [key, file] : first) files.push_back(file);
  return files;
}
}  // namespace lbea::io
