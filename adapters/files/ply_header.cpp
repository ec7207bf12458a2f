#include "adapters/files/ply_header.hpp"

#include "adapters/files/text_line.hpp"

#include <algorithm>

namespace lbea::io::ply {
namespace {
struct ScalarNames {
  Scalar type;
  std::string_view name, other_name;
};
constexpr std::array scalar_names{
    ScalarNames{Scalar::int8, "char", "int8"},        ScalarNames{Scalar::uint8, "uchar", "uint8"},
    ScalarNames{Scalar::int16, "short", "int16"},     ScalarNames{Scalar::uint16, "ushort", "uint16"},
    ScalarNames{Scalar::int32, "int", "int32"},       ScalarNames{Scalar::uint32, "uint", "uint32"},
    ScalarNames{Scalar::float32, "float", "float32"}, ScalarNames{Scalar::float64, "double", "float64"}};

class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& name) : lines_(text, name, "PLY header") {}

  Header parse() {
    std::string_view line;
    if (!lines_.next(line) || text::trimmed(line) != "ply") lines_.fail("the first line is not \"ply\"");
    while (lines_.next(line)) {
      const std::string_view keyword = text::next_word(line);
      if (keyword == "end_header") return finish();
      read_line(keyword, line);
    }
    lines_.fail("the header has no \"end_header\"; the file is cut short");
  }

 private:
  void read_line(std::string_view keyword, std::string_view rest) {
    if (keyword == "format")
      read_format(rest);
    else if (keyword == "comment" || keyword == "obj_info")
      read_comment(rest);
    else if (keyword == "element")
      read_element(rest);
    else if (keyword == "property")
      read_property(rest);
    else if (!keyword.empty())
      lines_.fail("unknown keyword \"" + std::string(keyword) + "\"");
  }

  void read_format(std::string_view rest) {
    const std::string_view format = text::next_word(rest);
    constexpr std::array<std::string_view, 3> names{"ascii", "binary_little_endian", "binary_big_endian"};
    const auto at = std::ranges::find(names, format);
    if (at == names.end()) lines_.fail("unknown format \"" + std::string(format) + "\"", Status::unsupported_input);
    header_.format = static_cast<Format>(at - names.begin());
    if (text::next_word(rest) != "1.0") lines_.fail("the version of the format is not 1.0", Status::unsupported_input);
    has_format_ = true;
  }

  void read_comment(std::string_view rest) {
    if (!header_.stamp_ns) header_.stamp_ns = text::find_stamp(rest);
  }

  void read_element(std::string_view rest) {
    Element element;
    element.name = text::next_word(rest);
    if (element.name.empty() || !text::parse_integer(text::next_word(rest), element.count))
      lines_.fail("expected \"element <name> <count>\"");
    header_.elements.push_back(std::move(element));
  }

  void read_property(std::string_view rest) {
    if (header_.elements.empty()) lines_.fail("a property before the first element");
    Property property;
    std::string_view type = text::next_word(rest);
    if (type == "list") {
      property.count_type = scalar(text::next_word(rest));
      if (binary::is_real(*property.count_type)) lines_.fail("the count of a list is not an integer");
      type = text::next_word(rest);
    }
    property.type = scalar(type);
    property.name = text::next_word(rest);
    if (property.name.empty()) lines_.fail("a property without a name");
    header_.elements.back().properties.push_back(std::move(property));
  }

  Scalar scalar(std::string_view word) const {
    for (const auto& [type, name, other_name] : scalar_names)
      if (word == name || word == other_name) return type;
    lines_.fail("unknown type \"" + std::string(word) + "\"");
  }

  Header finish() {
    if (!has_format_) lines_.fail("the header has no \"format\" line");
    header_.bytes = lines_.byte();
    header_.lines = lines_.line();
    return std::move(header_);
  }

  text::LineReader lines_;
  Header header_;
  bool has_format_ = false;
};
}  // namespace

Header parse_header(std::string_view text, const std::string& name) { return HeaderParser(text, name).parse(); }
}  // namespace lbea::io::ply
