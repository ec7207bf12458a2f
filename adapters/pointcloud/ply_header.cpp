#include "adapters/pointcloud/ply_header.hpp"

#include "adapters/pointcloud/text_line.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <charconv>
#include <utility>

namespace lbea::pointcloud {

namespace {

constexpr std::array<std::size_t, 8> scalar_sizes{1, 1, 2, 2, 4, 4, 4, 8};

constexpr std::array<std::pair<std::string_view, PlyScalar>, 16> scalar_names{{
    {"char", PlyScalar::int8},
    {"uchar", PlyScalar::uint8},
    {"short", PlyScalar::int16},
    {"ushort", PlyScalar::uint16},
    {"int", PlyScalar::int32},
    {"uint", PlyScalar::uint32},
    {"float", PlyScalar::float32},
    {"double", PlyScalar::float64},
    {"int8", PlyScalar::int8},
    {"uint8", PlyScalar::uint8},
    {"int16", PlyScalar::int16},
    {"uint16", PlyScalar::uint16},
    {"int32", PlyScalar::int32},
    {"uint32", PlyScalar::uint32},
    {"float32", PlyScalar::float32},
    {"float64", PlyScalar::float64},
}};

class HeaderParser {
 public:
  HeaderParser(std::string_view text, const std::string& name) : lines_(text), name_(name) {}

  PlyHeader parse() {
    std::string_view line;
    if (!lines_.next(line) || trimmed(line) != "ply") fail("the first line is not \"ply\"");
    while (lines_.next(line)) {
      const std::string_view keyword = next_word(line);
      if (keyword == "end_header") return finish();
      take(keyword, line);
    }
    fail("the header has no \"end_header\"; the file is cut short");
  }

 private:
  void take(std::string_view keyword, std::string_view rest) {
    if (keyword == "format") take_format(rest);
    else if (keyword == "comment" || keyword == "obj_info") take_comment(rest);
    else if (keyword == "element") take_element(rest);
    else if (keyword == "property") take_property(rest);
    else if (!keyword.empty()) fail("unknown keyword \"" + std::string(keyword) + "\"");
  }

  void take_format(std::string_view rest) {
    const std::string_view format = next_word(rest);
    if (format == "ascii") header_.format = PlyFormat::ascii;
    else if (format == "binary_little_endian") header_.format = PlyFormat::little_endian;
    else if (format == "binary_big_endian") header_.format = PlyFormat::big_endian;
    else fail("unknown format \"" + std::string(format) + "\"", Status::unsupported_input);
    if (next_word(rest) != "1.0") fail("the version of the format is not 1.0", Status::unsupported_input);
    has_format_ = true;
  }

  void take_comment(std::string_view rest) {
    if (!header_.stamp_ns) header_.stamp_ns = find_stamp(rest);
  }

  void take_element(std::string_view rest) {
    PlyElement element;
    element.name = next_word(rest);
    const std::string_view count = next_word(rest);
    const auto [stop, error] = std::from_chars(count.data(), count.data() + count.size(), element.count);
    if (element.name.empty() || count.empty() || error != std::errc{} || stop != count.data() + count.size())
      fail("expected \"element <name> <count>\"");
    header_.elements.push_back(std::move(element));
  }

  void take_property(std::string_view rest) {
    if (header_.elements.empty()) fail("a property before the first element");
    PlyProperty property;
    std::string_view type = next_word(rest);
    if (type == "list") {
      property.count_type = scalar(next_word(rest));
      if (*property.count_type >= PlyScalar::float32) fail("the count of a list is not an integer");
      type = next_word(rest);
    }
    property.type = scalar(type);
    property.name = next_word(rest);
    if (property.name.empty()) fail("a property without a name");
    header_.elements.back().properties.push_back(std::move(property));
  }

  PlyScalar scalar(std::string_view word) const {
    for (const auto& [scalar_name, type] : scalar_names)
      if (word == scalar_name) return type;
    fail("unknown type \"" + std::string(word) + "\"");
  }

  PlyHeader finish() {
    if (!has_format_) fail("the header has no \"format\" line");
    header_.bytes = lines_.byte();
    header_.lines = lines_.line();
    return std::move(header_);
  }

  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const {
    throw Error(status, name_ + ", line " + std::to_string(lines_.line()) + ": " + what + " (PLY header)");
  }

  LineReader lines_;
  const std::string& name_;
  PlyHeader header_;
  bool has_format_ = false;
};

}  // namespace

std::size_t size_of(PlyScalar type) noexcept { return scalar_sizes[static_cast<std::size_t>(type)]; }

PlyHeader parse_ply_header(std::string_view text, const std::string& name) {
  return HeaderParser(text, name).parse();
}

}  // namespace lbea::pointcloud
