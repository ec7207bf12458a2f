#include "adapters/pointcloud/ply_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace lbea::pointcloud {

namespace {

std::uint64_t load_bits(const std::byte* at, std::size_t size, bool big_endian) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < size; ++i)
    bits |= std::to_integer<std::uint64_t>(at[big_endian ? size - 1 - i : i]) << (8 * i);
  return bits;
}

float load_float(const std::byte* at, PlyScalar type, bool big_endian) {
  const std::uint64_t bits = load_bits(at, size_of(type), big_endian);
  switch (type) {
    case PlyScalar::int8:
      return static_cast<float>(static_cast<std::int8_t>(bits));
    case PlyScalar::int16:
      return static_cast<float>(static_cast<std::int16_t>(bits));
    case PlyScalar::int32:
      return static_cast<float>(static_cast<std::int32_t>(bits));
    case PlyScalar::float32:
      return std::bit_cast<float>(static_cast<std::uint32_t>(bits));
    case PlyScalar::float64:
      return static_cast<float>(std::bit_cast<double>(bits));
    case PlyScalar::uint8:
    case PlyScalar::uint16:
    case PlyScalar::uint32:
      break;
  }
  return static_cast<float>(bits);
}

bool is_signed(PlyScalar type) {
  return type == PlyScalar::int8 || type == PlyScalar::int16 || type == PlyScalar::int32;
}

/// Least bytes a row takes: lists may be empty.
std::size_t least_size(const PlyElement& element) {
  std::size_t size = 0;
  for (const PlyProperty& property : element.properties)
    size += size_of(property.count_type.value_or(property.type));
  return size;
}

bool has_list(const PlyElement& element) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [](const PlyProperty& property) { return property.count_type.has_value(); });
}

class BinaryRows {
 public:
  BinaryRows(std::span<const std::byte> bytes, const PlyHeader& header, const std::string& name)
      : bytes_(bytes), at_(header.bytes), big_endian_(header.format == PlyFormat::big_endian), name_(name) {}

  void skip(const PlyElement& element) {
    check_count(element);
    if (!has_list(element)) at_ += static_cast<std::size_t>(element.count) * least_size(element);
    else
      for (std::uint64_t row = 0; row < element.count; ++row) read_row(element);
  }

  std::vector<Point> read(const PlyElement& vertex) {
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
  bool is_packed(const PlyElement& vertex) const {
    const auto& p = vertex.properties;
    if (big_endian_ || p.size() != 3 || std::endian::native != std::endian::little) return false;
    for (std::size_t i = 0; i < 3; ++i)
      if (axis_of(p[i]) != i || p[i].type != PlyScalar::float32) return false;
    return true;
  }

  /// x, y, z; the last place takes what is not asked for.
  std::array<float, 4> read_row(const PlyElement& element) {
    std::array<float, 4> row{};
    for (const PlyProperty& property : element.properties) {
      if (property.count_type) skip_list(property);
      else row[axis_of(property)] = load_float(take(size_of(property.type)), property.type, big_endian_);
    }
    return row;
  }

  void skip_list(const PlyProperty& property) {
    const PlyScalar type = *property.count_type;
    const std::size_t size = size_of(type);
    const std::uint64_t count = load_bits(take(size), size, big_endian_);
    if (is_signed(type) && (count >> (8 * size - 1)) != 0) fail("a list with a negative count");
    take(static_cast<std::size_t>(count) * size_of(property.type));  // at most 2^32 * 8
  }

  const std::byte* take(std::size_t size) {
    if (size > bytes_.size() - at_) fail("the file ends within a row; it is cut short");
    at_ += size;
    return bytes_.data() + at_ - size;
  }

  void check_count(const PlyElement& element) const {
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

}  // namespace

std::vector<Point> read_binary_points(std::span<const std::byte> bytes, const PlyHeader& header,
                                      const std::string& name) {
  return read_points(BinaryRows(bytes, header, name), header.elements);
}

}  // namespace lbea::pointcloud
