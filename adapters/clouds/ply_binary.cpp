#include "adapters/clouds/ply_rows.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

namespace lbea::io::clouds {
namespace {

bool is_signed(ply::Scalar type) {
  return type == ply::Scalar::int8 || type == ply::Scalar::int16 || type == ply::Scalar::int32;
}

/// Least bytes a row takes: lists may be empty.
std::size_t least_size(const ply::Element& element) {
  std::size_t size = 0;
  for (const ply::Property& property : element.properties)
    size += ply::size_of(property.count_type.value_or(property.type));
  return size;
}

bool has_list(const ply::Element& element) {
  return std::any_of(element.properties.begin(), element.properties.end(),
                     [](const ply::Property& property) { return property.count_type.has_value(); });
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

  /// x, y, z; the last place takes what is not asked for.
  std::array<float, 4> read_row(const ply::Element& element) {
    std::array<float, 4> row{};
    for (const ply::Property& property : element.properties) {
      if (property.count_type)
        skip_list(property);
      else
        row[axis_of(property)] =
            static_cast<float>(ply::load(take(ply::size_of(property.type)), property.type, big_endian_));
    }
    return row;
  }

  void skip_list(const ply::Property& property) {
    const ply::Scalar type = *property.count_type;
    const std::size_t size = ply::size_of(type);
    const std::uint64_t count = ply::load_bits(take(size), size, big_endian_);
    if (is_signed(type) && (count >> (8 * size - 1)) != 0) fail("a list with a negative count");
    take(static_cast<std::size_t>(count) * ply::size_of(property.type));  // at most 2^32 * 8
  }

  const std::byte* take(std::size_t size) {
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

}  // namespace

std::vector<Point> read_binary_points(std::span<const std::byte> bytes, const ply::Header& header,
                                      const std::string& name) {
  return read_points(BinaryRows(bytes, header, name), header.elements);
}

}  // namespace lbea::io::clouds
