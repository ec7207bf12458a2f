#include "adapters/ensemble/ensemble_toml.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::io {
namespace {
std::string_view trimmed(std::string_view text) { return text::trimmed(text, " \t\r"); }

/// Fields of a line; separators inside double quotes are part of a field.
std::vector<std::string> split(std::string_view line, char separator) {
  std::vector<std::string> fields(1);
  bool is_quoted = false;
  for (const char c : line) {
    if (c == '"')
      is_quoted = !is_quoted;
    else if (c == separator && !is_quoted)
      fields.emplace_back();
    else
      fields.back() += c;
  }
  for (std::string& field : fields) field = trimmed(field);
  return fields;
}

char separator_of(std::string_view header) {
  for (const char separator : {';', '\t'})
    if (header.find(separator) != std::string_view::npos) return separator;
  return ',';
}

bool is_missing(std::string_view field) {
  constexpr std::array<std::string_view, 7> words{"", "nan", "NaN", "NAN", "NA", "n/a", "-"};
  return std::find(words.begin(), words.end(), field) != words.end();
}

class CsvParser {
 public:
  CsvParser(std::string_view text, const std::string& name) : lines_(text::checked_encoding(text, name), name) {}

  ParameterTable parse() {
    std::string_view line;
    if (!next_line(line)) lines_.fail("no line of names: the first column names the run, the others the parameters");
    read_header(line);
    while (next_line(line)) read_row(line);
    return std::move(table_);
  }

 private:
  /// The next line that is neither empty nor a comment.
  bool next_line(std::string_view& line) {
    while (lines_.next(line))
      if (!trimmed(line).empty() && line[0] != '#') return true;
    return false;
  }

  void read_header(std::string_view line) {
    separator_ = separator_of(line);
    const auto fields = split(line, separator_);
    for (std::size_t i = 1; i < fields.size(); ++i) {
      const std::size_t bracket = fields[i].ends_with(']') ? fields[i].rfind('[') : std::string::npos;
      const std::string name(trimmed(fields[i].substr(0, bracket)));
      if (name.empty()) lines_.fail("column " + std::to_string(i + 1) + " has no name");
      if (std::find(table_.names.begin(), table_.names.end(), name) != table_.names.end())
        lines_.fail("two columns are named \"" + name + "\"");
      table_.names.push_back(name);
      table_.units.emplace_back(
          bracket == std::string::npos ? "" : trimmed(fields[i].substr(bracket + 1, fields[i].size() - bracket - 2)));
    }
  }

  void read_row(std::string_view line) {
    const auto fields = split(line, separator_);
    if (fields.size() != table_.names.size() + 1)
      lines_.fail(std::to_string(fields.size()) + " fields where the names are " +
                  std::to_string(table_.names.size() + 1));
    if (fields[0].empty()) lines_.fail("no run name in the first column");
    if (table_.row(fields[0])) lines_.fail("a second row for run \"" + fields[0] + "\"");
    table_.runs.push_back(fields[0]);
    for (std::size_t i = 1; i < fields.size(); ++i) table_.values.push_back(number(fields[i], table_.names[i - 1]));
  }

  double number(std::string field, const std::string& column) const {
    if (is_missing(field)) return std::numeric_limits<double>::quiet_NaN();
    if (separator_ != ',') std::replace(field.begin(), field.end(), ',', '.');
    const std::size_t sign = field[0] == '+' ? 1 : 0;
    double value = 0;
    const auto [stop, error] = std::from_chars(field.data() + sign, field.data() + field.size(), value);
    if (error != std::errc{} || stop != field.data() + field.size() || !std::isfinite(value))
      lines_.fail("\"" + field.substr(0, 40) + "\" in column \"" + column +
                  "\" is not a number; leave it empty when unknown");
    return value;
  }

  text::LineReader lines_;
  char separator_ = ',';
  ParameterTable table_;
};

constexpr std::string_view between = " \t\r,;";

/// Reads the ids of one line.
void read_ids(const text::LineReader& lines, std::string_view line, std::vector<std::uint32_t>& ids) {
  line = line.substr(0, line.find('#'));
  for (std::size_t at = line.find_first_not_of(between); at != std::string_view::npos;
       at = line.find_first_not_of(between, at)) {
    const std::size_t end = std::min(line.find_first_of(between, at), line.size());
    const std::string_view word = line.substr(at, end - at);
    std::uint32_t id = 0;
    if (!text::parse_integer(word, id))
      lines.fail(text::quoted(word) + " is not a node id, a whole number from 0 to 4294967295");
    ids.push_back(id);
    at = end;
  }
}
}  // namespace

std::optional<std::span<const double>> ParameterTable::row(std::string_view run) const {
  const auto at = std::find(runs.begin(), runs.end(), run);
  if (at == runs.end()) return std::nullopt;
  const auto index = static_cast<std::size_t>(at - runs.begin());
  return std::span(values).subspan(index * names.size(), names.size());
}

ParameterTable read_parameters_csv(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  return CsvParser(as_text(bytes), path.string()).parse();
}

std::vector<std::uint32_t> read_node_ids(const std::filesystem::path& path) {
  const auto bytes = read_file(path);
  const std::string name = path.string();
  text::LineReader lines(text::checked_encoding(as_text(bytes), name), name);
  std::vector<std::uint32_t> ids;
  for (std::string_view line; lines.next(line);) read_ids(lines, line, ids);
  if (ids.empty()) throw Error(Status::bad_input, name + ": no node ids");
  return ids;
}
}  // namespace lbea::io
