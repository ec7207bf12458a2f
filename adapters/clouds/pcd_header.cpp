#include "adapters/clouds/pcd_header.hpp"

#include "adapters/files/text_line.hpp"

#include <lbea/lbea.hpp>

#include <charconv>

namespace lbea::io::clouds {
namespace {

constexpr std::uint64_t most = 0xffffffff;

class PcdHeaderParser {
 public:
  PcdHeaderParser(std::string_view text, const std::string& name) : lines_(text), name_(name) {}

  PcdHeader parse() {
    for (std::string_view line; lines_.next(line);) {
      if (line.starts_with('#')) {
        if (!header_.stamp_ns) header_.stamp_ns = text::find_stamp(line);
        continue;
      }
      const std::string_view keyword = text::next_word(line);
      take(keyword, line);
      if (keyword == "DATA") return finish();
    }
    fail("the header has no \"DATA\"; the file is cut short");
  }

 private:
  void take(std::string_view keyword, std::string_view rest) {
    if (keyword == "FIELDS")
      take_fields(rest);
    else if (keyword == "SIZE")
      each(rest, [&](PcdField& field, std::string_view word) { field.size = number(word); });
    else if (keyword == "COUNT")
      each(rest, [&](PcdField& field, std::string_view word) { field.count = number(word); });
    else if (keyword == "TYPE")
      each(rest, [&](PcdField& field, std::string_view word) { field.type = word[0]; });
    else if (keyword == "WIDTH")
      width_ = number(text::trimmed(rest));
    else if (keyword == "HEIGHT")
      height_ = number(text::trimmed(rest));
    else if (keyword == "POINTS")
      points_ = number(text::trimmed(rest));
    else if (keyword == "DATA")
      take_storage(text::trimmed(rest));
    else if (keyword != "VERSION" && keyword != "VIEWPOINT" && !keyword.empty())
      fail("unknown keyword \"" + std::string(keyword.substr(0, 40)) + "\"");
  }

  void take_fields(std::string_view rest) {
    header_.fields.clear();
    for (std::string_view word = text::next_word(rest); !word.empty(); word = text::next_word(rest))
      header_.fields.push_back({std::string(word), 4, 'F', 1});
  }

  template <class Body>
  void each(std::string_view rest, Body body) {
    for (PcdField& field : header_.fields) {
      const std::string_view word = text::next_word(rest);
      if (word.empty()) fail("fewer entries than fields");
      body(field, word);
    }
  }

  void take_storage(std::string_view name) {
    if (name == "ascii")
      header_.storage = PcdStorage::text;
    else if (name == "binary")
      header_.storage = PcdStorage::binary;
    else if (name == "binary_compressed")
      header_.storage = PcdStorage::packed;
    else
      fail("data stored as \"" + std::string(name.substr(0, 40)) + "\" are not read", Status::unsupported_input);
  }

  PcdHeader finish() {
    for (std::size_t axis = 0; axis < 3; ++axis) find_axis(axis);
    for (const PcdField& field : header_.fields)
      if (field.size == 0 || field.size > 8 || field.count == 0) fail("field \"" + field.name + "\" has no size");
    header_.points = points_.value_or(width_ * height_);
    if (width_ != 0 && width_ * height_ != header_.points) fail("WIDTH times HEIGHT are not POINTS");
    header_.is_organised = height_ > 1;
    header_.bytes = lines_.byte();
    header_.lines = lines_.line();
    return std::move(header_);
  }

  void find_axis(std::size_t axis) {
    const std::string wanted(1, static_cast<char>('x' + static_cast<int>(axis)));
    std::size_t found = 0;
    for (std::size_t f = 0; f < header_.fields.size(); ++f)
      if (header_.fields[f].name == wanted) header_.axes[axis] = f, ++found;
    if (found != 1 || header_.fields[header_.axes[axis]].count != 1)
      fail("the fields x, y and z are needed, each once");
    if (!scalar_of(header_.fields[header_.axes[axis]]))
      fail("coordinates of this type are not read", Status::unsupported_input);
  }

  std::uint64_t number(std::string_view word) const {
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (word.empty() || error != std::errc{} || end != word.data() + word.size() || value > most)
      fail("\"" + std::string(word.substr(0, 40)) + "\" is not a count");
    return value;
  }

  [[noreturn]] void fail(const std::string& what, Status status = Status::bad_input) const {
    throw Error(status, name_ + ", line " + std::to_string(lines_.line()) + ": " + what + " (PCD header)");
  }

  text::LineReader lines_;
  const std::string& name_;
  PcdHeader header_;
  std::uint64_t width_ = 0, height_ = 1;
  std::optional<std::uint64_t> points_;
};

}  // namespace

std::uint64_t PcdHeader::point_bytes() const noexcept {
  std::uint64_t sum = 0;
  for (const PcdField& field : fields) sum += field.size * field.count;  // at most 8 * 2^32 each
  return sum;
}

std::optional<ply::Scalar> scalar_of(const PcdField& field) noexcept {
  using enum ply::Scalar;
  if (field.type == 'F')
    return field.size == 4 ? std::optional(float32) : field.size == 8 ? std::optional(float64) : std::nullopt;
  if (field.type != 'I' && field.type != 'U') return std::nullopt;
  const bool is_signed = field.type == 'I';
  switch (field.size) {
    case 1:
      return is_signed ? int8 : uint8;
    case 2:
      return is_signed ? int16 : uint16;
    case 4:
      return is_signed ? int32 : uint32;
    default:
      return std::nullopt;
  }
}

PcdHeader parse_pcd_header(std::string_view text, const std::string& name) {
  return PcdHeaderParser(text, name).parse();
}

}  // namespace lbea::io::clouds
