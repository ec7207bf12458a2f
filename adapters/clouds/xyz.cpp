#include "adapters/clouds/point_cloud.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"

#include <algorithm>

namespace lbea::io {
namespace {
constexpr std::size_t longest_number = 64;
constexpr std::size_t no_column = std::numeric_limits<std::size_t>::max();

struct XyzColumns {
  char separator = text::Fields::blanks;
  bool has_decimal_comma = false;
  std::array<std::size_t, 3> axes{0, 1, 2};                           // columns of x, y, z, from 0
  std::array<std::size_t, 3> added{no_column, no_column, no_column};  // displacements
};

/// A field as a number; an empty one is NaN. False when it is neither.
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

/// "1,5<tab>2,5": every comma is between two digits.
bool commas_are_decimal(std::string_view line) {
  for (std::size_t i = line.find(','); i != std::string_view::npos; i = line.find(',', i + 1))
    if (i == 0 || i + 1 == line.size() || !text::is_digit(line[i - 1]) || !text::is_digit(line[i + 1])) return false;
  return true;
}

bool has_blank(std::string_view field) { return std::any_of(field.begin(), field.end(), text::is_blank); }

char separator_of(std::string_view line) {
  if (line.find(';') != std::string_view::npos) return ';';
  if (line.find('\t') != std::string_view::npos && commas_are_decimal(line)) {
    const auto fields = text::split(line, '\t');
    return std::any_of(fields.begin(), fields.end(), has_blank) ? text::Fields::blanks : '\t';
  }
  return line.find(',') != std::string_view::npos ? ',' : text::Fields::blanks;
}

/// Names may contain blanks, but no decimal comma.
std::vector<std::string_view> split_names(std::string_view line) {
  for (const char separator : {';', ',', '\t'})
    if (line.find(separator) != std::string_view::npos) return text::split(line, separator);
  return text::split(line, text::Fields::blanks);
}

/// "x [mm] y [mm]" -> "x  y ", because units would look like columns.
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
  return field.size() == 1 || !(text::is_letter(field[1]) || text::is_digit(field[1]));
}

/// 'x' for "pos_x", "Coord. X".
bool ends_with_axis(std::string_view field, char axis) {
  const std::size_t end = field.size();
  return end >= 2 && names_axis(field.substr(end - 1), axis) && !text::is_letter(field[end - 2]) &&
         !text::is_digit(field[end - 2]);
}

using Axes = std::optional<std::array<std::size_t, 3>>;

/// The column named `letter`: one that has no other letters is preferred to, e.g., "x_error". Among three columns the
/// letter may also be at the end. Sets `problem` when
/// several are possible, such as pixels "x" and positions "X".
std::size_t axis_column(const std::vector<std::string_view>& names, char letter, std::string& problem) {
  std::vector<std::size_t> exact, similar;
  for (std::size_t i = 0; i < names.size(); ++i)
    if (names_axis(names[i], letter) || (names.size() == 3 && ends_with_axis(names[i], letter)))
      (names[i].size() == 1 ? exact : similar).push_back(i);
  const auto& found = exact.empty() ? similar : exact;
  if (found.size() > 1 && problem.empty())
    problem = "columns \"" + std::string(names[found[0]]) + "\" and \"" + std::string(names[found[1]]) +
              "\" could both be " + letter + "; choose with --columns, e.g. --columns X,Y,Z";
  return found.empty() ? no_column : found[0];
}

/// The columns named x, y, z. A `width` other than 0 is the required number of columns.
Axes named_axes(std::string_view line, std::size_t width, std::string& problem) {
  const std::string plain = without_units(line);
  const auto names = split_names(plain);
  if (width != 0 && names.size() != width) return std::nullopt;
  std::array<std::size_t, 3> axes{};
  for (std::size_t axis = 0; axis < 3; ++axis)
    axes[axis] = axis_column(names, static_cast<char>('x' + static_cast<int>(axis)), problem);
  if (std::ranges::find(axes, no_column) != axes.end()) return std::nullopt;
  return axes;
}

/// Finds "X,Y,Z" or "X+U,Y+V,Z+W" among the names. On failure sets `problem`.
void choose_columns(std::string_view chosen, std::string_view line, XyzColumns& columns, std::string& problem) {
  const std::string plain = without_units(line);
  const auto names = split_names(plain), axes = text::split(chosen, ',');
  const auto column = [&](std::string_view name) {
    const auto at = std::ranges::find(names, name, [](std::string_view n) { return text::trimmed(n); });
    if (at == names.end() || std::find(at + 1, names.end(), *at) != names.end())
      problem = "--columns: the header does not name one column \"" + std::string(name) + "\"; it is \"" +
                std::string(line.substr(0, 200)) + "\"";
    return static_cast<std::size_t>(at - names.begin());
  };
  if (axes.size() != 3) problem = "--columns needs three columns or sums, e.g. X,Y,Z or X+U,Y+V,Z+W";
  for (std::size_t axis = 0; axis < 3 && problem.empty(); ++axis) {
    const std::size_t plus = axes[axis].find('+');
    columns.axes[axis] = column(text::trimmed(axes[axis].substr(0, plus)));
    if (plus != std::string_view::npos) columns.added[axis] = column(text::trimmed(axes[axis].substr(plus + 1)));
  }
}

/// Sets `problem` when more values than names follow: commas that separate and commas that are decimal look alike.
void compare_width(std::string_view names, std::vector<std::string_view> values, char separator, std::string& problem) {
  if (separator == text::Fields::blanks || names.find(separator) == std::string_view::npos) return;
  while (!values.empty() && text::trimmed(values.back()).empty()) values.pop_back();
  const std::size_t count = split_names(without_units(names)).size();
  if (values.size() > count)
    problem = "the header names " + std::to_string(count) + " columns, but the line has " +
              std::to_string(values.size()) + "; with decimal commas, separate columns by semicolons or tabs";
}

Axes first_numeric(const std::vector<std::string_view>& fields, bool has_decimal_comma) {
  std::array<std::size_t, 3> axes{};
  std::size_t found = 0;
  float ignored = 0;
  for (std::size_t i = 0; i < fields.size() && found < 3; ++i)
    if (!fields[i].empty() && parse_field(fields[i], has_decimal_comma, ignored)) axes[found++] = i;
  return found == 3 ? std::optional(axes) : std::nullopt;
}

/// True for a line of names: letters, and no field that is a number.
bool is_name_line(std::string_view line) {
  if (std::none_of(line.begin(), line.end(), text::is_letter)) return false;
  const auto fields = text::split(line, separator_of(line));
  float ignored = 0;
  return std::none_of(fields.begin(), fields.end(),
                      [&](auto field) { return !field.empty() && parse_field(field, true, ignored); });
}

/// Separator and columns. `names` is the line of names, empty when there is none. `remark` is the last comment; it
/// counts as a line of names only when it has as many as `numbers` has fields. On failure returns nothing and sets
/// `problem`.
std::optional<XyzColumns> find_columns(std::string_view names, std::string_view remark, std::string_view numbers,
                                       std::string_view chosen, std::string& problem) {
  XyzColumns columns;
  columns.separator = separator_of(numbers);
  columns.has_decimal_comma = columns.separator == ';' || columns.separator == '\t';
  const auto fields = text::split(numbers, columns.separator);
  compare_width(names, fields, columns.separator, problem);
  if (!problem.empty()) return std::nullopt;
  if (!chosen.empty()) {
    choose_columns(chosen, names.empty() ? remark : names, columns, problem);
    return problem.empty() ? std::optional(columns) : std::nullopt;
  }
  Axes axes = named_axes(names, 0, problem);
  if (!axes) axes = named_axes(remark, fields.size(), problem);
  if (!problem.empty()) return std::nullopt;
  const std::size_t named = split_names(without_units(names)).size();
  if (!axes && (named > 3 || (named == 3 && fields.size() == 3))) {
    problem =
        "the header names columns, but not x, y and z; choose them with --columns, e.g. --columns X,Y,Z, or remove it";
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

class XyzParser {
 public:
  XyzParser(std::string_view text, const std::string& name, std::string_view chosen)
      : lines_(text, name), chosen_(chosen) {
    cloud_.source = name;
  }

  PointCloud parse() {
    for (std::string_view line; lines_.next(line);) {
      line = text::trimmed(line);
      if (line.empty()) continue;
      if (const std::size_t mark = comment_mark(line))
        read_comment(line.substr(mark));
      else if (columns_)
        read_point(line);
      else
        read_first(line);
    }
    return std::move(cloud_);
  }

 private:
  /// The length of the comment mark at the start of a line; 0 without one.
  static std::size_t comment_mark(std::string_view line) {
    if (line[0] == '#' || line[0] == '%') return 1;
    return line.starts_with("//") ? 2 : 0;
  }

  void read_comment(std::string_view comment) {
    if (!cloud_.stamp_ns) cloud_.stamp_ns = text::find_stamp(comment);
    if (!columns_) remark_ = text::trimmed(comment);
  }

  /// The lines before the first point: names, also below a title.
  void read_first(std::string_view line) {
    std::string ignored;
    const bool is_below_title = !named_axes(names_, 0, ignored) && named_axes(line, 0, ignored);
    if (is_name_line(line) && (names_.empty() || is_below_title)) {
      names_ = line;
      return;
    }
    std::string problem;
    columns_ = find_columns(names_, remark_, line, chosen_, problem);
    if (!columns_) lines_.fail(problem);
    for (const auto& used : {columns_->axes, columns_->added})
      for (const std::size_t column : used)
        if (column != no_column) last_column_ = std::max(last_column_, column);
    cloud_.points.reserve(lines_.rest().size() / (line.size() + 1) + 1);  // exact when all lines are alike
    read_point(line);
  }

  void read_point(std::string_view line) {
    std::array<float, 3> position{};
    text::Fields fields(line, columns_->separator);
    std::string_view field;
    for (std::size_t column = 0; column <= last_column_; ++column) {
      if (!fields.next(field))
        lines_.fail(std::to_string(column) + " columns where " + std::to_string(last_column_ + 1) + " are needed");
      for (std::size_t axis = 0; axis < 3; ++axis)
        if (columns_->axes[axis] == column || columns_->added[axis] == column) position[axis] += number(field);
    }
    cloud_.points.push_back({position[0], position[1], position[2]});
  }

  [[nodiscard]] float number(std::string_view field) const {
    float value = 0;
    if (!parse_field(field, columns_->has_decimal_comma, value)) lines_.fail(text::quoted(field) + " is not a number");
    return value;
  }

  text::LineReader lines_;
  PointCloud cloud_;
  std::string_view chosen_, names_, remark_;
  std::optional<XyzColumns> columns_;
  std::size_t last_column_ = 0;
};
}  // namespace

/// Any file without a zero byte, so this format is tried last. Text in UTF-16 is taken to be refused by its name.
bool is_xyz(std::string_view start, std::size_t) noexcept {
  return start.find('\0') == std::string_view::npos || start.starts_with("\xff\xfe") || start.starts_with("\xfe\xff");
}

/// Text, a point per line. Columns are separated by blanks, tabs, commas or semicolons (with semicolons and with tabs,
/// a comma may be the decimal sign). A line of names, which may be a comment, tells the columns x, y, z; without it
/// they are the first three that hold numbers. Empty fields and "nan" give NaN. Lines that begin with #, % or // are
/// comments.
PointCloud parse_xyz(std::span<const std::byte> bytes, const std::string& name) {
  return parse_text_cloud(bytes, name, {});
}

PointCloud parse_text_cloud(std::span<const std::byte> bytes, const std::string& name, std::string_view columns) {
  if (bytes.empty()) throw Error(Status::bad_input, name + ": the file is empty");
  return XyzParser(text::checked_encoding(as_text(bytes), name), name, columns).parse();
}
}  // namespace lbea::io
