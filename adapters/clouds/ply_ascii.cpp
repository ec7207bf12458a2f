#include "adapters/clouds/ply_rows.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace lbea::io::clouds {
namespace {

class AsciiRows {
 public:
  AsciiRows(std::string_view text, const ply::Header& header, const std::string& name)
      : lines_(text.substr(header.bytes)), header_lines_(header.lines), name_(name) {}

  void skip(const ply::Element& element) {
    if (element.properties.empty()) return;
    for (std::uint64_t row = 0; row < element.count; ++row) (void)next_row(element, row);
  }

  std::vector<Point> read(const ply::Element& vertex) {
    std::vector<Point> points;
    points.reserve(std::min(static_cast<std::size_t>(vertex.count), most_rows(vertex)));
    for (std::uint64_t row = 0; row < vertex.count; ++row) points.push_back(read_point(vertex, next_row(vertex, row)));
    return points;
  }

 private:
  /// Every value takes a digit and a separator.
  std::size_t most_rows(const ply::Element& element) const {
    return lines_.rest().size() / (2 * element.properties.size()) + 1;
  }

  std::string_view next_row(const ply::Element& element, std::uint64_t row) {
    std::string_view line;
    while (lines_.next(line))
      if (!text::trimmed(line).empty()) return line;
    fail("the file ends after " + std::to_string(row) + " of " + std::to_string(element.count) + " rows of element \"" +
         element.name + "\"; it is cut short");
  }

  Point read_point(const ply::Element& vertex, std::string_view line) const {
    std::array<float, 4> row{};
    std::size_t missing = 3;
    for (const ply::Property& property : vertex.properties) {
      if (missing == 0) break;
      const std::size_t axis = axis_of(property);
      if (property.count_type)
        skip_list(line);
      else if (axis == no_axis)
        (void)text::next_word(line);
      else
        row[axis] = number(text::next_word(line)), --missing;
    }
    return {row[0], row[1], row[2]};
  }

  void skip_list(std::string_view& line) const {
    const float count = number(text::next_word(line));
    if (!(count >= 0)) fail("a list with a negative count");
    for (float i = 0; i < count && !line.empty(); ++i) (void)text::next_word(line);
  }

  float number(std::string_view word) const {
    float value = 0;
    if (word.empty()) fail("too few values");
    if (!text::parse_number(word, value)) fail("\"" + std::string(word.substr(0, 40)) + "\" is not a number");
    return value;
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Status::bad_input, name_ + ", line " + std::to_string(header_lines_ + lines_.line()) + ": " + what);
  }

  text::LineReader lines_;
  std::size_t header_lines_;
  const std::string& name_;
};

}  // namespace

std::vector<Point> read_ascii_points(std::span<const std::byte> bytes, const ply::Header& header,
                                     const std::string& name) {
  return read_points(AsciiRows(as_text(bytes), header, name), header.elements);
}

}  // namespace lbea::io::clouds
