#include "adapters/clouds/pcd_header.hpp"
#include "adapters/clouds/pointcloud.hpp"
#include "adapters/files/atomic_file.hpp"
#include "adapters/files/text_line.hpp"

extern "C" {
#include <liblzf/lzf.h>
}

#include <algorithm>
#include <limits>

namespace lbea::io {

namespace clouds {
namespace {

constexpr std::uint64_t densest_lzf = 100;  // 3 bytes stand for 264 at most

[[noreturn]] void fail(const std::string& name, const std::string& place, const std::string& what) {
  throw Error(Status::bad_input, name + ", " + place + ": " + what + " (PCD)");
}

/// Values of a point in a line; those that are no coordinates may be anything.
std::vector<Point> text_points(std::string_view text, const PcdHeader& header, const std::string& name) {
  text::LineReader lines(text.substr(header.bytes));
  const auto place = [&] { return "line " + std::to_string(header.lines + lines.line()); };
  std::vector<Point> points;
  for (std::string_view line; points.size() < header.points;) {
    if (!lines.next(line))
      fail(name, place(),
           "the file ends after " + std::to_string(points.size()) + " of " + std::to_string(header.points) +
               " points; it is cut short");
    if (text::trimmed(line).empty()) continue;
    std::array<float, 3> at{};
    for (std::size_t f = 0; f < header.fields.size(); ++f) {
      const auto axis =
          static_cast<std::size_t>(std::find(header.axes.begin(), header.axes.end(), f) - header.axes.begin());
      if (axis == header.axes.size())
        for (std::uint64_t i = 0; i < header.fields[f].count && !line.empty(); ++i) text::next_word(line);
      else if (!text::parse_number(text::next_word(line), at[axis]))
        fail(name, place(), "expected a number");
    }
    points.push_back({at[0], at[1], at[2]});
  }
  return points;
}

/// Where a field's value of point i is: points one by one, or field by field.
std::vector<Point> binary_points(std::span<const std::byte> data, const PcdHeader& header, bool is_by_field) {
  std::array<std::size_t, 3> start{}, stride{};
  std::array<ply::Scalar, 3> scalar{};
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
      return static_cast<float>(ply::load(data.data() + start[axis] + i * stride[axis], scalar[axis], false));
    };
    points[i] = {value(0), value(1), value(2)};
  }
  return points;
}

std::vector<std::byte> unpacked(std::span<const std::byte> data, std::uint64_t size, const std::string& name) {
  if (data.size() < 8) fail(name, "byte " + std::to_string(data.size()), "the file is cut short");
  const std::uint64_t packed = ply::load_bits(data.data(), 4, false);
  if (packed > data.size() - 8 || ply::load_bits(data.data() + 4, 4, false) != size || size / densest_lzf > packed)
    fail(name, "the packed data", "their size does not fit the points; the file is damaged or cut short");
  std::vector<std::byte> bytes(size);
  if (size > 0 &&
      lzf_decompress(data.data() + 8, static_cast<unsigned>(packed), bytes.data(), static_cast<unsigned>(size)) != size)
    fail(name, "the packed data", "they do not unpack; the file is damaged");
  return bytes;
}

std::vector<Point> read_pcd_points(std::span<const std::byte> bytes, const PcdHeader& header, const std::string& name) {
  if (header.storage == PcdStorage::text) return text_points(as_text(bytes), header, name);
  const auto data = bytes.subspan(header.bytes);
  const std::uint64_t size = header.point_bytes();
  if (header.points > 0 && size > std::numeric_limits<std::uint32_t>::max() / header.points)
    fail(name, "the header", "more than 4 GB of points; the file is damaged");
  if (header.storage == PcdStorage::packed)
    return binary_points(unpacked(data, size * header.points, name), header, true);
  if (size * header.points > data.size())
    fail(name, "byte " + std::to_string(bytes.size()),
         "the file ends before the last of " + std::to_string(header.points) + " points; it is cut short");
  return binary_points(data, header, false);
}

}  // namespace
}  // namespace clouds

PointCloud parse_pcd(std::span<const std::byte> bytes, const std::string& name) {
  const clouds::PcdHeader header = clouds::parse_pcd_header(as_text(bytes), name);
  PointCloud cloud{clouds::read_pcd_points(bytes, header, name), header.stamp_ns, name};
  if (header.is_organised) mark_empty_pixels(cloud.points);
  return cloud;
}

/// The sensor stands at the origin: nothing is measured there.
void mark_empty_pixels(std::vector<Point>& points) noexcept {
  constexpr float nothing = std::numeric_limits<float>::quiet_NaN();
  for (Point& point : points)
    if (point.x == 0 && point.y == 0 && point.z == 0) point = {nothing, nothing, nothing};
}

}  // namespace lbea::io
