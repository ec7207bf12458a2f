// Writes tables of comma-separated values.
#pragma once

#include <cmath>
#include <sstream>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>

namespace lbea::tool {

/// Quoted when necessary.
inline std::string csv_field(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + '"';
}

/// Numbers that are not finite and optionals without a value become empty cells.
class CsvTable {
 public:
  /// Without the end of the line: add() may append columns.
  explicit CsvTable(std::string_view header) { out_ << header; }
  template <class... Values>
  void add(const Values&... values) {
    (add_cell(values), ...);
  }
  void end_row() {
    out_ << '\n';
    is_row_empty_ = true;
  }
  [[nodiscard]] std::string text() const { return out_.str(); }

 private:
  template <class Value>
  void add_cell(const Value& value) {
    if (!std::exchange(is_row_empty_, false)) out_ << ',';
    if constexpr (std::is_convertible_v<Value, std::string_view>) {
      out_ << csv_field(value);
    } else if constexpr (std::is_floating_point_v<Value>) {
      if (std::isfinite(value)) out_ << value;
    } else if constexpr (requires { value.has_value(); }) {
      if (value) out_ << *value;
    } else {
      out_ << value;
    }
  }

  std::ostringstream out_;
  bool is_row_empty_ = false;  // the header has no line end yet
};

}  // namespace lbea::tool
