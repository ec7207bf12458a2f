#include "adapters/clouds/xyz_columns.hpp"

#include "adapters/files/text_line.hpp"

#include <algorithm>
#include <limits>
#include <vector>

namespace lbea::io::clouds {
namespace {

constexpr std::size_t longest_number = 64;

bool is_digit(char c) { return c >= '0' && c <= '9'; }
bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

std::vector<std::string_view> split(std::string_view line, char separator) {
  std::vector<std::string_view> fields;
  Fields reader(line, separator);
  for (std::string_view field; reader.next(field);) fields.push_back(field);
  return fields;
}

/// "1,5<tab>2,5": every comma stands between two digits.
bool commas_are_decimal(std::string_view line) {
  for (std::size_t i = line.find(','); i != std::string_view::npos; i = line.find(',', i + 1))
    if (i == 0 || i + 1 == line.size() || !is_digit(line[i - 1]) || !is_digit(line[i + 1])) return false;
  return true;
}

bool has_blank(std::string_view field) { return std::any_of(field.begin(), field.end(), text::is_blank); }

char separator_of(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return ';';
  if (line.find('\t') != std::string_view::npos && commas_are_decimal(line)) {
    const auto fields = split(line, '\t');
    return std::any_of(fields.begin(), fields.end(), has_blank) ? Fields::blanks : '\t';
  }
  return line.find(',') != std::string_view::npos ? ',' : Fields::blanks;
}

/// Names, unlike numbers, may have blanks in them, and no decimal comma.
std::vector<std::string_view> split_names(std::string_view line) {
  for (const char separator : {';', ',', '\t'})
    if (line.find(separator) != std::string_view::npos) return split(line, separator);
  return split(line, Fields::blanks);
}

/// "x [mm] y [mm]" -> "x  y ": units would look like columns.
std::string without_units(std::string_view names) {
  std::string text;
  int depth = 0;
  for (const char c : names) {
    if (c == '[' || c == '(') ++depth;
    if (depth == 0) text += c;
    if ((c == ']' || c == ')') && depth > 0) --depth;
  }
  return text;
}

/// 'x' for "x", "X", "x_mm"; not for "xylem" or "x1".
bool names_axis(std::string_view field, char axis) {
  if (field.empty() || (field[0] != axis && field[0] != axis - 'a' + 'A')) return false;
  return field.size() == 1 || !(is_letter(field[1]) || is_digit(field[1]));
}

using Axes = std::optional<std::array<std::size_t, 3>>;

/// The columns named x, y, z. A `width` other than 0 is how many columns there must be.
Axes named_axes(std::string_view line, std::size_t width) {
  const std::string plain = without_units(line);
  const auto names = split_names(plain);
  if (width != 0 && names.size() != width) return std::nullopt;
  std::array<std::size_t, 3> axes{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const char letter = static_cast<char>('x' + static_cast<int>(axis));
    const auto at = std::find_if(names.begin(), names.end(), [&](auto field) { return names_axis(field, letter); });
    if (at == names.end()) return std::nullopt;
    axes[axis] = static_cast<std::size_t>(at - names.begin());
  }
  return axes;
}

Axes first_numeric(const std::vector<std::string_view>& fields, bool has_decimal_comma) {
  std::array<std::size_t, 3> axes{};
  std::size_t found = 0;
  float ignored = 0;
  for (std::size_t i = 0; i < fields.size() && found < 3; ++i)
    if (!fields[i].empty() && parse_field(fields[i], has_decimal_comma, ignored)) axes[found++] = i;
  return found == 3 ? std::optional(axes) : std::nullopt;
}

}  // namespace

bool Fields::next(std::string_view& field) noexcept {
  if (separator_ == blanks) {
    field = text::next_word(rest_);
    if (field.empty()) return false;
  } else {
    if (at_end_) return false;
    const std::size_t stop = rest_.find(separator_);
    field = text::trimmed(rest_.substr(0, stop));
    at_end_ = stop == std::string_view::npos;
    if (!at_end_) rest_.remove_prefix(stop + 1);
  }
  if (field.size() >= 2 && field.front() == '"' && field.back() == '"') field = field.substr(1, field.size() - 2);
  return true;
}

bool parse_field(std::string_view field, bool has_decimal_comma, float& value) noexcept {
  if (field.empty()) {
    value = std::numeric_limits<float>::quiet_NaN();
    return true;
  }
  if (!has_decimal_comma || field.find(',') == std::string_view::npos) return text::parse_number(field, value);
  std::array<char, longest_number> digits{};
  if (field.size() > digits.size()) return false;
  std::replace_copy(field.begin(), field.end(), digits.begin(), ',', '.');
  return text::parse_number({digits.data(), field.size()}, value);
}

bool is_name_line(std::string_view line) {
  if (std::none_of(line.begin(), line.end(), is_letter)) return false;
  const auto fields = split(line, separator_of(line));
  float ignored = 0;
  return std::none_of(fields.begin(), fields.end(),
                      [&](auto field) { return !field.empty() && parse_field(field, true, ignored); });
}

std::optional<XyzColumns> find_columns(std::string_view names, std::string_view remark, std::string_view numbers,
                                       std::string& problem) {
  XyzColumns columns;
  columns.separator = separator_of(numbers);
  columns.has_decimal_comma = columns.separator == ';' || columns.separator == '\t';
  const auto fields = split(numbers, columns.separator);
  Axes axes = named_axes(names, 0);
  if (!axes) axes = named_axes(remark, fields.size());
  if (!axes && split_names(without_units(names)).size() > 3) {
    problem = "the header names columns, but not x, y and z; name them so, or this is not a point cloud";
    return std::nullopt;
  }
  if (!axes) axes = first_numeric(fields, columns.has_decimal_comma);
  if (!axes) {
    problem = "fewer than 3 columns with numbers; expected x, y, z separated by blanks, tabs, commas or semicolons";
    return std::nullopt;
  }
  columns.axes = *axes;
  return columns;
}

}  // namespace lbea::io::clouds
