#include "adapters/clouds/point_cloud.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/file_names.hpp"
#include "adapters/files/text_line.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>

namespace lbea::io {
namespace {
constexpr std::array<std::pair<std::string_view, std::int64_t>, 4> units{
    {{"ns", 1}, {"us", 1'000}, {"ms", 1'000'000}, {"s", 1'000'000'000}}};
constexpr std::int64_t second = 1'000'000'000;

/// Decimal digits times a unit, exact to the ns; nothing when it does not fit into 64 bits.
std::optional<std::int64_t> in_ns(std::string_view number, std::int64_t unit) noexcept {
  const bool is_negative = number.starts_with('-');
  if (is_negative) number.remove_prefix(1);
  std::int64_t value = 0, scale = unit;
  bool is_after_point = false, has_digit = false;
  for (const char c : number) {
    if (c == '.' && !is_after_point) {
      is_after_point = true;
      continue;
    }
    if (!text::is_digit(c)) return std::nullopt;
    has_digit = true;
    const std::int64_t digit = c - '0';
    if (is_after_point) {
      scale /= 10;
      if (__builtin_add_overflow(value, digit * scale, &value)) return std::nullopt;
    } else if (__builtin_mul_overflow(value, std::int64_t{10}, &value) ||
               __builtin_add_overflow(value, digit * unit, &value)) {
      return std::nullopt;
    }
  }
  if (!has_digit) return std::nullopt;
  return is_negative ? -value : value;
}

/// The number at `at`: digits with at most one decimal point between them.
std::string_view number_at(std::string_view text, std::size_t at) noexcept {
  std::size_t end = at;
  bool has_point = false;
  for (; end < text.size(); ++end) {
    const bool is_point = text[end] == '.' && !has_point && end + 1 < text.size() && text::is_digit(text[end + 1]);
    if (!text::is_digit(text[end]) && !is_point) break;
    has_point = has_point || is_point;
  }
  return text.substr(at, end - at);
}

std::optional<std::int64_t> since_1970(std::string_view number) noexcept {
  const std::size_t point = number.find('.');
  if (point != std::string_view::npos) return point == 10 ? in_ns(number, second) : std::nullopt;
  if (number.size() == 13) return in_ns(number, 1'000'000);
  if (number.size() == 16) return in_ns(number, 1'000);
  return number.size() == 19 ? in_ns(number, 1) : std::nullopt;
}

std::optional<std::int64_t> unit_named(std::string_view word) noexcept {
  for (const auto& [name, ns] : units)
    if (word == name) return ns;
  return std::nullopt;
}

/// The unit at the end of a column's name: "stamp_ns", "time [s]"; nothing when the column is not a time.
std::optional<std::int64_t> unit_of_column(const std::string& name) {
  constexpr std::array<std::string_view, 4> times{"stamp", "timestamp", "time", "t"};
  const std::size_t end = std::min(name.find_first_of("_ [("), name.size());
  if (std::find(times.begin(), times.end(), name.substr(0, end)) == times.end()) return std::nullopt;
  const std::size_t first = name.find_first_not_of("_ [(", end);
  if (first == std::string::npos) return std::nullopt;
  return unit_named(std::string_view(name).substr(first, name.find_first_of(" ])", first) - first));
}

struct TableColumns {
  std::size_t file = 0, time = 0;
  std::int64_t unit = 1;
};

char table_separator(std::string_view line) {
  for (const char separator : {';', '\t', ','})
    if (line.find(separator) != std::string_view::npos) return separator;
  return text::Fields::blanks;
}

std::optional<TableColumns> columns_of(const std::vector<std::string_view>& names) {
  constexpr std::array<std::string_view, 4> files{"file", "filename", "name", "cloud"};
  TableColumns columns{names.size(), names.size(), 1};
  for (std::size_t i = names.size(); i-- > 0;) {
    const std::string name = text::lower(names[i]);
    if (std::find(files.begin(), files.end(), name) != files.end()) columns.file = i;
    if (const auto unit = unit_of_column(name)) columns.time = i, columns.unit = *unit;
  }
  return columns.file < names.size() && columns.time < names.size() ? std::optional(columns) : std::nullopt;
}
}  // namespace

std::optional<std::int64_t> stamp_in_name(std::string_view stem) noexcept {
  std::optional<std::int64_t> found;
  for (std::size_t at = 0; at < stem.size(); ++at) {
    if (!text::is_digit(stem[at])) continue;
    const std::string_view number = number_at(stem, at);
    const std::size_t end = at + number.size();
    std::size_t letters = end;
    while (letters < stem.size() && text::is_letter(stem[letters])) ++letters;
    const auto unit = unit_named(stem.substr(end, letters - end));
    const std::size_t before = at > 0 && stem[at - 1] == '=' ? at - 1 : at;  // "t=3.5"
    const bool is_after_t = before > 0 && stem[before - 1] == 't' && (before < 2 || !text::is_letter(stem[before - 2]));
    if (unit)
      found = in_ns(number, *unit);
    else if (is_after_t && (number.find('.') != std::string_view::npos || before != at))
      found = in_ns(number, second);
    else if (letters == end && !found)
      found = since_1970(number);
    at = end;
  }
  return found;
}

CloudStamps::CloudStamps(const std::filesystem::path& table) {
  const auto bytes = read_file(table);
  const std::string name = table.string();
  text::LineReader lines(text::checked_encoding(as_text(bytes), name), name);
  std::optional<TableColumns> columns;
  char separator = ',';
  for (std::string_view line; lines.next(line);) {
    if (text::trimmed(line).empty() || (columns && line.starts_with('#'))) continue;
    if (!columns) {
      if (line.starts_with('#')) line.remove_prefix(1);
      separator = table_separator(line);
      columns = columns_of(text::split(line, separator));
      if (!columns)
        lines.fail(
            "the columns are not named; expected a column \"file\" and one of the time with its unit, such as "
            "\"stamp_ns\"");
      continue;
    }
    const auto words = text::split(line, separator);
    if (words.size() <= std::max(columns->file, columns->time)) lines.fail("too few columns");
    const auto stamp = in_ns(words[columns->time], columns->unit);
    if (!stamp) lines.fail(text::quoted(words[columns->time]) + " is not a time");
    const std::string file = path_of(words[columns->file]).filename().string();
    if (const auto [at, is_new] = table_.emplace(file, *stamp); !is_new && at->second != *stamp)
      lines.fail(file + " has another time above");
  }
  if (!columns) lines.fail("the table is empty");
}

std::optional<std::int64_t> CloudStamps::of(const std::filesystem::path& file,
                                            std::optional<std::int64_t> in_file) const {
  for (const std::string& name : {file.filename().string(), file.stem().string()})
    if (const auto found = table_.find(name); found != table_.end()) return found->second;
  if (!table_.empty())
    throw Error{
        Status::bad_input,
        file.string() +
            ": is not in the table of stamps; clouds of one test need one clock, so add its line or remove the table"};
  return in_file ? in_file : stamp_in_name(file.stem().string());
}
}  // namespace lbea::io
