#include "adapters/clouds/point_cloud.hpp"

#include "adapters/files/atomic_file.hpp"
#include "adapters/files/ply_header.hpp"
#include "adapters/files/text_line.hpp"

#include <algorithm>
#include <bit>
#include <cstring>

namespace lbea::io {
namespace {
constexpr std::size_t no_axis = 3;

/// 0, 1, 2 for the properties x, y, z; no_axis for any other.
std::size_t axis_of(const ply::Property& property) noexcept {
  if (property.count_type || property.name.size() != 1) return no_axis;
  const char letter = property.name[0];
  return letter >= 'x' && letter <= 'z' ? static_cast<std::size_t>(letter - 'x') : no_axis;
}

class AsciiRows {
 public:
  AsciiRows(std::string_view text, const ply::Header& header, const std::string& name)
      : lines_(text.substr(header.bytes), name, {}, header.lines) {}

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
  /// Every value takes at least a digit and a separator.
  std::size_t most_rows(const ply::Element& element) const {
    return lines_.rest().size() / (2 * element.properties.size()) + 1;
  }

  std::string_view next_row(const ply::Element& element, std::uint64_t row) {
    std::string_view line;
    while (lines_.next(line))
      if (!text::trimmed(line).empty()) return line;
    lines_.fail("the file ends after " + std::to_string(row) + " of " + std::to_string(element.count) +
                " rows of element \"" + element.name + "\"; it is cut short");
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
    if (!(count >= 0)) lines_.fail("a list with a negative count");
    for (float i = 0; i < count && !line.empty(); ++i) (void)text::next_word(line);
  }

  float number(std::string_view word) const {
    float value = 0;
    if (word.empty()) lines_.fail("too few values");
    if (!text::parse_number(word, value)) lines_.fail(text::quoted(word) + " is not a number");
    return value;
  }

  text::LineReader lines_;
};

/// The fewest bytes a row takes, with all lists empty.
std::size_t least_size(const ply::Element& element) {
  std::size_t size = 0;
  for (const ply::Property& property : element.properties)
    size += binary::size_of(property.count_type.value_or(property.type));
  return size;
}

bool has_list(const ply::Element& element) {
  return std::ranges::any_of(element.properties, [](const auto& property) { return property.count_type.has_value(); });
}

class BinaryRows {
 public:
  BinaryRows(std::span<const std::byte> bytes, const ply::Header& header, const std::string& name)
      : bytes_(bytes), at_(header.bytes), big_endian_(header.format == ply::Format::big_endian), name_(name) {}

  void skip(const ply::Element& element) {
    check_count(element);
    if (!has_list(element))
      at_ += static_cast<std::size_t>(element.count) * least_size(element);
    else
      for (std::uint64_t row = 0; row < element.count; ++row) read_row(element);
  }

  std::vector<Point> read(const ply::Element& vertex) {
    check_count(vertex);
    std::vector<Point> points(static_cast<std::size_t>(vertex.count));
    if (is_packed(vertex)) {
      if (!points.empty()) std::memcpy(points.data(), bytes_.data() + at_, points.size() * sizeof(Point));
      return points;
    }
    for (Point& point : points) {
      const std::array<float, 4> row = read_row(vertex);
      point = {row[0], row[1], row[2]};
    }
    return points;
  }

 private:
  bool is_packed(const ply::Element& vertex) const {
    const auto& p = vertex.properties;
    if (big_endian_ || p.size() != 3 || std::endian::native != std::endian::little) return false;
    for (std::size_t i = 0; i < 3; ++i)
      if (axis_of(p[i]) != i || p[i].type != ply::Scalar::float32) return false;
    return true;
  }

  /// x, y, z; the fourth entry receives all other properties.
  std::array<float, 4> read_row(const ply::Element& element) {
    std::array<float, 4> row{};
    for (const ply::Property& property : element.properties) {
      if (property.count_type)
        skip_list(property);
      else
        row[axis_of(property)] =
            static_cast<float>(binary::load(next(binary::size_of(property.type)), property.type, big_endian_));
    }
    return row;
  }

  void skip_list(const ply::Property& property) {
    const ply::Scalar type = *property.count_type;
    const std::size_t size = binary::size_of(type);
    const std::uint64_t count = binary::load_bits(next(size), size, big_endian_);
    if (binary::is_signed_integer(type) && (count >> (8 * size - 1)) != 0) fail("a list with a negative count");
    next(static_cast<std::size_t>(count) * binary::size_of(property.type));  // at most 2^32 * 8
  }

  const std::byte* next(std::size_t size) {
    if (size > bytes_.size() - at_) fail("the file ends within a row; it is cut short");
    at_ += size;
    return bytes_.data() + at_ - size;
  }

  void check_count(const ply::Element& element) const {
    const std::size_t size = least_size(element);
    if (size > 0 && element.count > (bytes_.size() - at_) / size)
      fail("element \"" + element.name + "\" declares " + std::to_string(element.count) + " rows of at least " +
           std::to_string(size) + " bytes, but the file ends after " + std::to_string(bytes_.size()) +
           "; it is cut short");
  }

  [[noreturn]] void fail(const std::string& what) const {
    throw Error(Status::bad_input, name_ + ", byte " + std::to_string(at_) + ": " + what);
  }

  std::span<const std::byte> bytes_;
  std::size_t at_;
  bool big_endian_;
  const std::string& name_;
};

/// The points of the element "vertex"; the elements before it are skipped, those after it are not read.
template <class Rows>
std::vector<Point> read_points(Rows rows, const std::vector<ply::Element>& elements) {
  for (const ply::Element& element : elements) {
    if (element.name == "vertex") return rows.read(element);
    rows.skip(element);
  }
  return {};
}

void check_axes(const ply::Header& header, const std::string& name) {
  const auto vertex = std::ranges::find(header.elements, "vertex", &ply::Element::name);
  if (vertex == header.elements.end())
    throw Error(Status::bad_input, name + ": no element \"vertex\", so no points; export the cloud with its vertices");
  std::array<int, 4> found{};
  for (const ply::Property& property : vertex->properties) ++found[axis_of(property)];
  if (found[0] != 1 || found[1] != 1 || found[2] != 1)
    throw Error(Status::bad_input, name + ": the element \"vertex\" needs the properties x, y and z, each once");
}
}  // namespace

bool is_ply(std::string_view start, std::size_t) noexcept {
  return start == "ply" || start.starts_with("ply\n") || start.starts_with("ply\r") ||
         start.starts_with("ply ");  // "ply" alone: cut short, which its parser says
}

/// ASCII or binary of either byte order. Reads the properties x, y, z of the element "vertex", whatever their scalar
/// type, and skips all others.
PointCloud parse_ply(std::span<const std::byte> bytes, const std::string& name) {
  const ply::Header header = ply::parse_header(as_text(bytes), name);
  check_axes(header, name);
  auto points = header.format == ply::Format::ascii
                    ? read_points(AsciiRows(as_text(bytes), header, name), header.elements)
                    : read_points(BinaryRows(bytes, header, name), header.elements);
  return {std::move(points), header.stamp_ns, name};
}

static_assert(std::endian::native == std::endian::little && sizeof(Point) == 12,
              "points are written in their memory layout");

void write_ply(const std::filesystem::path& path, std::span<const Point> points,
               std::span<const std::string> comments) {
  std::string header = "ply\nformat binary_little_endian 1.0\n";
  for (const std::string& comment : comments) {
    if (comment.find_first_of("\r\n") != std::string::npos)
      throw Error(Status::bad_config, "a comment for " + path.string() + " has a line break: give it as two comments");
    header += "comment " + comment + "\n";
  }
  header += "element vertex " + std::to_string(points.size()) +
            "\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
  AtomicFile file(path);
  file.write(header);
  file.write(std::as_bytes(points));
  file.commit();
}
}  // namespace lbea::io
