#include "adapters/files/ply_header.hpp"

#include "adapters/files/text_line.hpp"

#include <lbea/lbea.hpp>

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
  HeaderParser(std::string_view text, const std::string& name) : lines_(text), name_(name) {}

  Header parse() {
    std::string_view line;
    if (!lines_.next(line) || text::trimmed(line) != "ply") fail("the first line is not \"ply\"");
    while (lines_.next(line)) {
      const std::string_view keyword = text::next_word(line);
      if (keyword == "end_header") return finish();
      read_line(keyword, line);
    }
    fail("the header has no \"end_header\"; the file is cut short");
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
      fail("unknown keyword \"" + std::string(keyword) + "\"");
  }

  void read_format(std::string_view rest) {
    const std::string_view format = text::next_word(rest);
    if (format == "ascii")
      header_.format = Format::ascii;
    else if (format == "binary_little_endian")
      header_.format = Format::little_endian;
    else if (format == "binary_big_endian")
      header_.format = Format::big_endian;
    else
      fail("unknown format \"" + std::string(format) + "\"", Status::unsupported_input);
    if (text::next_word(rest) != "1.0") fail("the version of the format is not 1.0", Status::unsupported_input);
    has_format_ = true;
  }

  void read_comment(std::string_view rest) {
    if (!header_.stamp_ns) header_.stamp_ns = text::find_stamp(rest);
  }

  void read_element(std::string_view rest) {
    Element element;
    element.name = text::next_word(rest);
    if (element.name.empty() || !text::parse_integer(text::next_word(rest), element.count))
      fail("expected \"element <name> <count>\"");
    header_.elements.push_back(std::move(element));
  }

  void read_property(std::string_view rest) {
    if (header_.elements.empty()) fail("a property before the first element");
    Property property;
    std::string_view type = text::next_word(rest);
    if (type == "list") {
      property.count_type = scalar(text::next_word(rest));
      if (binary::is_real(*property.count_type)) fail("the count of a list is not an integer");
      type = text::next_word(rest);
    }
    property.type = scalar(type);
    property.name = text::next_word(rest);
    if (property.name.empty()) fail("a property without a name");
    header_.elements.back().properties.push_back(std::move(property));
  }

  Scalar scalar(std::string_view word) const {
    for (const auto& [type, name, other_name] : scalar_names)
      if (word == name || word == other_name) return type;
    fail("unknown type \"" + std::string(word) + "\"");
  }

  Header finish() {
    if (!has_format_) fail("the header has no \"format\" line");
    header_.bytes = lines_.byte();
    header_.lines = lines_.line();
    return std::move(header_);
  }

  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const {
    throw Error(status, name_ + ", line " + std::to_string(lines_.line()) + ": " + what + " (PLY header)");
  }

  text::LineReader lines_;
  const std::string& name_;
  Header header_;
  bool has_format_ = false;
};

}  // namespace

Header parse_header(std::string_view text, const std::string& name) { return HeaderParser(text, name).parse(); }

}  // namespace lbea::io::ply
