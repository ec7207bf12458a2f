#include "adapters/clouds/point_cloud.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/binary_numbers.hpp"
#include "adapters/files/text_line.hpp"

extern "C" {
#include <liblzf/lzf.h>
}

#include <algorithm>
#include <cmath>

namespace lbea::io {
namespace {
enum class PcdStorage { text, binary, compressed };

struct PcdField {
  std::string name;
  std::size_t size = 4;     // bytes of a value
  char type = 'F';          // I, U or F
  std::uint64_t count = 1;  // values per point
};

struct PcdHeader {
  std::vector<PcdField> fields;
  std::array<std::size_t, 3> axes{};  // fields of x, y, z
  std::uint64_t points = 0;           // as declared; not yet checked against the file's size
  bool is_organized = false;          // an image of points, in which some pixels may be empty
  PcdStorage storage = PcdStorage::text;
  std::optional<std::int64_t> stamp_ns;
  std::size_t bytes = 0, lines = 0;  // length of the header

  [[nodiscard]] std::uint64_t point_bytes() const noexcept {
    std::uint64_t sum = 0;
    for (const PcdField& field : fields) sum += field.size * field.count;  // at most 8 * 2^32 each
    return sum;
  }
};

/// The type of a field's values, when coordinates may have it.
std::optional<binary::Scalar> scalar_of(const PcdField& field) noexcept {
  using enum binary::Scalar;
  struct Known {
    char type;
    std::size_t size;
    binary::Scalar scalar;
  };
  constexpr std::array known{Known{'F', 4, float32}, Known{'F', 8, float64}, Known{'I', 1, int8},
                             Known{'U', 1, uint8},   Known{'I', 2, int16},   Known{'U', 2, uint16},
                             Known{'I', 4, int32},   Known{'U', 4, uint32}};
  for (const auto& [type, size, scalar] : known)
    if (field.type == type && field.size == size) return scalar;
  return std::nullopt;
}

constexpr std::uint64_t most = 0xffffffff;

class PcdHeaderParser {
 public:
  PcdHeaderParser(std::string_view text, const std::string& name) : lines_(text, name, "PCD header") {}

  PcdHeader parse() {
    for (std::string_view line; lines_.next(line);) {
      if (line.starts_with('#')) {
        if (!header_.stamp_ns) header_.stamp_ns = text::find_stamp(line);
        continue;
      }
      const std::string_view keyword = text::next_word(line);
      read_line(keyword, line);
      if (keyword == "DATA") return finish();
    }
    lines_.fail("the header has no \"DATA\"; the file is cut short");
  }

 private:
  void read_line(std::string_view keyword, std::string_view rest) {
    if (keyword == "FIELDS")
      read_fields(rest);
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
      read_storage(text::trimmed(rest));
    else if (keyword != "VERSION" && keyword != "VIEWPOINT" && !keyword.empty())
      lines_.fail("unknown keyword \"" + std::string(keyword.substr(0, 40)) + "\"");
  }

  void read_fields(std::string_view rest) {
    header_.fields.clear();
    for (std::string_view word = text::next_word(rest); !word.empty(); word = text::next_word(rest))
      header_.fields.push_back({std::string(word), 4, 'F', 1});
  }

  template <class Body>
  void each(std::string_view rest, Body body) {
    for (PcdField& field : header_.fields) {
      const std::string_view word = text::next_word(rest);
      if (word.empty()) lines_.fail("fewer entries than fields");
      body(field, word);
    }
  }

  void read_storage(std::string_view name) {
    constexpr std::array<std::string_view, 3> names{"ascii", "binary", "binary_compressed"};
    const auto at = std::ranges::find(names, name);
    if (at == names.end())
      lines_.fail("data stored as " + text::quoted(name) + " are not read", Status::unsupported_input);
    header_.storage = static_cast<PcdStorage>(at - names.begin());
  }

  PcdHeader finish() {
    for (std::size_t axis = 0; axis < 3; ++axis) find_axis(axis);
    for (const PcdField& field : header_.fields)
      if (field.size == 0 || field.size > 8 || field.count == 0)
        lines_.fail("field \"" + field.name + "\" has no size");
    header_.points = points_.value_or(width_ * height_);
    if (width_ != 0 && width_ * height_ != header_.points) lines_.fail("WIDTH times HEIGHT is not POINTS");
    header_.is_organized = height_ > 1;
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
      lines_.fail("the fields x, y and z are needed, each once");
    if (!scalar_of(header_.fields[header_.axes[axis]]))
      lines_.fail("coordinates of this type are not read", Status::unsupported_input);
  }

  std::uint64_t number(std::string_view word) const {
    std::uint64_t value = 0;
    if (!text::parse_integer(word, value) || value > most) lines_.fail(text::quoted(word) + " is not a count");
    return value;
  }

  text::LineReader lines_;
  PcdHeader header_;
  std::uint64_t width_ = 0, height_ = 1;
  std::optional<std::uint64_t> points_;
};

constexpr std::uint64_t densest_lzf = 100;  // 3 bytes stand for 264 at most

[[noreturn]] void fail(const std::string& name, const std::string& place, const std::string& what) {
  throw Error(Status::bad_input, name + ", " + place + ": " + what + " (PCD)");
}

/// One point per line; values other than coordinates may be any words.
std::vector<Point> text_points(std::string_view text, const PcdHeader& header, const std::string& name) {
  text::LineReader lines(text.substr(header.bytes), name, "PCD", header.lines);
  std::vector<Point> points;
  for (std::string_view line; points.size() < header.points;) {
    if (!lines.next(line))
      lines.fail("the file ends after " + std::to_string(points.size()) + " of " + std::to_string(header.points) +
                 " points; it is cut short");
    if (text::trimmed(line).empty()) continue;
    std::array<float, 3> at{};
    for (std::size_t f = 0; f < header.fields.size(); ++f) {
      const auto axis = static_cast<std::size_t>(std::ranges::find(header.axes, f) - header.axes.begin());
      if (axis == header.axes.size())
        for (std::uint64_t i = 0; i < header.fields[f].count && !line.empty(); ++i) text::next_word(line);
      else if (!text::parse_number(text::next_word(line), at[axis]))
        lines.fail("expected a number");
    }
    points.push_back({at[0], at[1], at[2]});
  }
  return points;
}

/// The values are stored point by point, or field by field.
std::vector<Point> binary_points(std::span<const std::byte> data, const PcdHeader& header, bool is_by_field) {
  std::array<std::size_t, 3> start{}, stride{};
  std::array<binary::Scalar, 3> scalar{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    std::size_t before = 0;
    for (std::size_t f = 0; f < header.axes[axis]; ++f) before += header.fields[f].size * header.fields[f].count;
    const PcdField& field = header.fields[header.axes[axis]];
    scalar[axis] = *scalar_of(field);
    start[axis] = is_by_field ? before * header.points : before;
    stride[axis] = is_by_field ? field.size : header.point_bytes();
  }
  std::vector<Point> points(header.points);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const auto value = [&](std::size_t axis) {
      return static_cast<float>(binary::load(data.data() + start[axis] + i * stride[axis], scalar[axis], false));
    };
    points[i] = {value(0), value(1), value(2)};
  }
  return points;
}

std::vector<std::byte> decompressed(std::span<const std::byte> data, std::uint64_t size, const std::string& name) {
  if (data.size() < 8) fail(name, "byte " + std::to_string(data.size()), "the file is cut short");
  const std::uint64_t compressed = binary::load_bits(data.data(), 4, false);
  if (compressed > data.size() - 8 || binary::load_bits(data.data() + 4, 4, false) != size ||
      size / densest_lzf > compressed)
    fail(name, "the compressed data", "their size does not match the points; the file is damaged or cut short");
  std::vector<std::byte> bytes(size);
  if (size > 0 && lzf_decompress(data.data() + 8, static_cast<unsigned>(compressed), bytes.data(),
                                 static_cast<unsigned>(size)) != size)
    fail(name, "the compressed data", "they cannot be decompressed; the file is damaged");
  return bytes;
}

std::vector<Point> read_pcd_points(std::span<const std::byte> bytes, const PcdHeader& header, const std::string& name) {
  if (header.storage == PcdStorage::text) return text_points(as_text(bytes), header, name);
  const auto data = bytes.subspan(header.bytes);
  const std::uint64_t size = header.point_bytes();
  if (header.points > 0 && size > std::numeric_limits<std::uint32_t>::max() / header.points)
    fail(name, "the header", "more than 4 GB of points; the file is damaged");
  if (header.storage == PcdStorage::compressed)
    return binary_points(decompressed(data, size * header.points, name), header, true);
  if (size * header.points > data.size())
    fail(name, "byte " + std::to_string(bytes.size()),
         "the file ends before the last of " + std::to_string(header.points) + " points; it is cut short");
  return binary_points(data, header, false);
}

/// Also points at the origin: the sensor stands there, so these are pixels without a point.
void remove_empty_pixels(std::vector<Point>& points) {
  std::erase_if(points, [](const Point& point) {
    return (std::isnan(point.x) && std::isnan(point.y) && std::isnan(point.z)) ||
           (point.x == 0 && point.y == 0 && point.z == 0);
  });
}
}  // namespace

bool is_pcd(std::string_view start, std::size_t) noexcept {
  return start.starts_with("# .PCD") || start.starts_with("VERSION 0.7") || start.starts_with("VERSION .7");
}

/// Text, binary or compressed (LZF). Reads the fields x, y, z. In organized clouds (HEIGHT above 1) pixels without a
/// point, NaN or 0 0 0, are left out.
PointCloud parse_pcd(std::span<const std::byte> bytes, const std::string& name) {
  const PcdHeader header = PcdHeaderParser(as_text(bytes), name).parse();
  PointCloud cloud{read_pcd_points(bytes, header, name), header.stamp_ns, name};
  if (header.is_organized) remove_empty_pixels(cloud.points);
  return cloud;
}
}  // namespace lbea::io
