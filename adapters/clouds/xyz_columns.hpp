// Where the columns of a text file with points are: told from its line of names and its first line of numbers.
#pragma once

#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <string_view>

namespace lbea::io::clouds {

/// Goes through the fields of a line.
class Fields {
 public:
  static constexpr char blanks = ' ';  // any run of blanks and tabs separates
  Fields(std::string_view line, char separator) : rest_(line), separator_(separator) {}
  /// False after the last field. Fields come without blanks and quotes around them.
  bool next(std::string_view& field) noexcept;

 private:
  std::string_view rest_;
  char separator_;
  bool at_end_ = false;
};

struct XyzColumns {
  char separator = Fields::blanks;
  bool has_decimal_comma = false;
  std::array<std::size_t, 3> axes{0, 1, 2};  // columns of x, y, z, from 0
};

/// A field as a number; an empty one is NaN. False when it is neither.
bool parse_field(std::string_view field, bool has_decimal_comma, float& value) noexcept;

/// True for a line of names: letters, and no field that is a number.
[[nodiscard]] bool is_name_line(std::string_view line);

/// Separator and columns. `names` is the line of names, empty when there is none; a remark that may be one counts
/// only when it fits the line of numbers. On failure returns nothing and says why in `problem`.
[[nodiscard]] std::optional<XyzColumns> find_columns(std::string_view names, std::string_view remark,
                                                     std::string_view numbers, std::string& problem);

}  // namespace lbea::io::clouds
