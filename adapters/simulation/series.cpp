#include "adapters/simulation/open.hpp"

#include "adapters/files/text_line.hpp"
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

/// The numbers of the files; nothing when one is too long to count with.
std::optional<std::vector<std::uint64_t>> numbers_of(const std::vector<fs::path>& series) {
  std::vector<std::uint64_t> numbers;
  for (const fs::path& file : series) {
    const std::string digits = split(file).digits;
    if (digits.empty() || !text::parse_integer(digits, numbers.emplace_back())) return std::nullopt;
  }
  return numbers;
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

void refuse_gap(const std::vector<fs::path>& series) {
  const auto numbers = numbers_of(series);
  if (!numbers || numbers->size() < 3) return;
  std::vector<std::uint64_t> steps;
  for (std::size_t i = 1; i < numbers->size(); ++i) steps.push_back((*numbers)[i] - (*numbers)[i - 1]);
  const auto count = [&](std::uint64_t step) { return std::ranges::count(steps, step); };
  const std::uint64_t usual = std::ranges::max(steps, {}, count);
  const bool is_usual = usual > 0 && count(usual) >= 2 && 2 * count(usual) >= std::ssize(steps);
  const bool is_regular = is_usual && std::ranges::all_of(steps, [&](const std::uint64_t& step) {
                            return step % usual == 0 || (&step == &steps.back() && step < usual);
                          });
  const auto gap = std::ranges::find_if(steps, [&](std::uint64_t step) { return step > usual; });
  if (!is_regular || gap == steps.end()) return;  // numbers of solver cycles are irregular without a gap
  const auto before = static_cast<std::size_t>(gap - steps.begin());
  throw Error{Status::bad_input, series[before + 1].string() + " follows " + series[before].filename().string() +
                                     ", number " + std::to_string((*numbers)[before] + usual) +
                                     " is missing; the files have no times, so the later states would come too early: "
                                     "add the missing files, export times, or move the later files elsewhere"};
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
