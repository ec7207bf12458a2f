#include "tests/clouds/cloud_support.hpp"

#include <doctest/doctest.h>

extern "C" {
#include <liblzf/lzf.h>
}

#include <cstring>
#include <limits>
#include <random>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

constexpr float none = std::numeric_limits<float>::quiet_NaN();

/// A point beside other values, in an order of its own.
struct Row {
  std::uint16_t ring;
  double y;
  float x, z;
};

std::string header(std::size_t points, const std::string& data, std::size_t height = 1) {
  return "# .PCD v0.7 - Point Cloud Data file format\n# stamp_ns 77\nVERSION 0.7\nFIELDS ring y x z\nSIZE 2 8 4 "
         "4\nTYPE U F F F\n"
         "COUNT 1 1 1 1\nWIDTH " +
         std::to_string(points / height) + "\nHEIGHT " + std::to_string(height) + "\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS " +
         std::to_string(points) + "\nDATA " + data + "\n";
}

template <class T>
void append(std::string& bytes, T value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
}

std::vector<Row> rows(std::size_t count) {
  std::mt19937 random(5);
  std::uniform_real_distribution<float> any(-500, 500);
  std::vector<Row> result;
  for (std::size_t i = 0; i < count; ++i)
    result.push_back({static_cast<std::uint16_t>(i), any(random), any(random), any(random)});
  return result;
}

std::vector<Point> points_of(const std::vector<Row>& rows) {
  std::vector<Point> points;
  for (const Row& row : rows) points.push_back({row.x, static_cast<float>(row.y), row.z});
  return points;
}

std::string binary(const std::vector<Row>& rows, std::size_t height = 1) {
  std::string bytes = header(rows.size(), "binary", height);
  for (const Row& row : rows) append(bytes, row.ring), append(bytes, row.y), append(bytes, row.x), append(bytes, row.z);
  return bytes;
}

/// Field by field, packed by the library that defines the format.
std::string packed(const std::vector<Row>& rows) {
  std::string fields, bytes = header(rows.size(), "binary_compressed");
  for (const Row& row : rows) append(fields, row.ring);
  for (const Row& row : rows) append(fields, row.y);
  for (const Row& row : rows) append(fields, row.x);
  for (const Row& row : rows) append(fields, row.z);
  std::string small(fields.size() * 2 + 64, '\0');
  const unsigned size = lzf_compress(fields.data(), static_cast<unsigned>(fields.size()), small.data(),
                                     static_cast<unsigned>(small.size()));
  append(bytes, std::uint32_t{size});
  append(bytes, static_cast<std::uint32_t>(fields.size()));
  return bytes + small.substr(0, size);
}

PointCloud parse_pcd(const std::string& bytes) { return parse_point_cloud(bytes_of(bytes), "a.pcd"); }
Error refusal(const std::string& bytes) {
  return error_of([&] { (void)parse_pcd(bytes); });
}

}  // namespace

TEST_CASE("PCD in every storage gives the points") {
  for (const std::size_t count : {0u, 1u, 2u, 17u, 1000u}) {
    CAPTURE(count);
    const auto written = rows(count);
    CHECK(same(parse_pcd(binary(written)).points, points_of(written)));
    if (count > 0) CHECK(same(parse_pcd(packed(written)).points, points_of(written)));
    CHECK(parse_pcd(binary(written)).stamp_ns == 77);
  }
  CHECK(
      same(parse_pcd(header(2, "ascii") + "1 2.5 -1 3\n7 nan nan nan\n").points, {{-1, 2.5f, 3}, {none, none, none}}));
}

TEST_CASE(
    "pixels of an organized cloud that hold no point are left out, and so do not count as points; in an unorganized "
    "one the origin is a point") {
  const std::vector<Row> written{{0, 0, 0, 0},          {1, 2, 1, 3}, {2, 0, 0, 4},
                                 {3, none, none, none}, {4, 5, 0, 0}, {5, 0, 6, 0}};
  CHECK(same(parse_pcd(binary(written, 2)).points, {{1, 2, 3}, {0, 0, 4}, {0, 5, 0}, {6, 0, 0}}));
  CHECK(same(parse_pcd(binary(written, 1)).points,
             {{0, 0, 0}, {1, 2, 3}, {0, 0, 4}, {none, none, none}, {0, 5, 0}, {6, 0, 0}}));
}

TEST_CASE("coordinates of every type, headers that begin with the version, blank lines, one stamp") {
  const std::vector<Point> point{{1, 2, 3}};
  for (const char* type : {"I", "U"})
    for (const std::size_t size : {1u, 2u, 4u}) {
      std::string text =
          std::string(size == 1 ? "VERSION 0.7" : "VERSION .7") + "\n\n# stamp_ns 5\n# stamp_ns 6\nFIELDS x y z\nSIZE";
      for (int i = 0; i < 3; ++i) text += " " + std::to_string(size);
      text += std::string("\nTYPE ") + type + " " + type + " " + type +
              "\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA binary\n";
      for (const std::uint32_t value : {1u, 2u, 3u}) text.append(reinterpret_cast<const char*>(&value), size);
      const PointCloud cloud = parse_point_cloud(bytes_of(text), "a.pcd");
      CHECK(same(cloud.points, point));
      CHECK(cloud.stamp_ns == 5);
    }
  CHECK(contains(list_cloud_formats(), "PCD"));
}

TEST_CASE("a PCD file cut anywhere is refused") {
  for (const std::string& whole : {binary(rows(5)), packed(rows(5)), header(2, "ascii") + "1 2 3 4\n1 2 3 4"})
    for (std::size_t length = 20; length + 1 < whole.size(); ++length) {
      CAPTURE(length);
      CHECK(refusal(whole.substr(0, length)).status != Status::ok);
    }
}

TEST_CASE("what a PCD header must not say is refused with the line") {
  const auto changed = [](const std::string& from, const std::string& to) {
    std::string text = header(1, "ascii") + "1 2 3 4\n";
    return text.replace(text.find(from), from.size(), to);
  };
  check_error(refusal(changed("y x z", "y x w")), Status::bad_input, {"a.pcd", "x, y and z"});
  check_error(refusal(changed("SIZE 2 8 4 4", "SIZE 2 8 4")), Status::bad_input, {"line 5", "fewer"});
  check_error(refusal(changed("POINTS 1", "POINTS 2")), Status::bad_input, {"WIDTH"});
  check_error(refusal(changed("POINTS 1", "POINTS -1")), Status::bad_input, {"line 11", "count"});
  check_error(refusal(changed("DATA ascii", "DATA zip")), Status::unsupported_input, {"zip"});
  check_error(refusal(changed("TYPE U F F F", "TYPE U F F X")), Status::unsupported_input, {"type"});
  check_error(refusal(changed("1 2 3 4", "1 2 3 four")), Status::bad_input, {"line 13", "number"});
  check_error(refusal(changed("1 2 3 4", "1 2 3")), Status::bad_input, {"line 13"});
  check_error(refusal(changed("SIZE 2 8 4 4", "SIZE 0 8 4 4")), Status::bad_input, {"\"ring\" has no size"});
  check_error(refusal(changed("SIZE 2 8 4 4", "SIZE 9 8 4 4")), Status::bad_input, {"\"ring\" has no size"});
  check_error(refusal(changed("COUNT 1 1 1 1", "COUNT 0 1 1 1")), Status::bad_input, {"\"ring\" has no size"});
  check_error(refusal(changed("COUNT 1 1 1 1", "COUNT 1 1 2 1")), Status::bad_input, {"x, y and z", "once"});
  check_error(refusal(changed("COUNT 1 1 1 1", "COUNT 99999999999 1 1 1")), Status::bad_input, {"not a count"});
  check_error(refusal(changed("VERSION 0.7", "VERSIONS 0.7")), Status::bad_input, {"unknown keyword"});
  for (const char* size : {"3", "8"})
    check_error(refusal(changed("SIZE 2 8 4 4\nTYPE U F F F", std::string("SIZE 2 8 4 ") + size + "\nTYPE U F F I")),
                Status::unsupported_input, {"type"});
  std::string forged = packed(rows(5));
  forged.replace(forged.find("WIDTH 5"), 7, "WIDTH 4000000000")
      .replace(forged.find("POINTS 5"), 8, "POINTS 4000000000");
  check_error(refusal(forged), Status::bad_input, {"4 GB"});
  forged = packed(rows(5));
  forged.replace(forged.find("WIDTH 5"), 7, "WIDTH 6").replace(forged.find("POINTS 5"), 8, "POINTS 6");
  check_error(refusal(forged), Status::bad_input, {"the compressed data", "size does not match"});
  forged = header(100'000, "binary_compressed");  // three bytes cannot hold as many
  append(forged, std::uint32_t{3}), append(forged, std::uint32_t{1'800'000});
  check_error(refusal(forged + "abc"), Status::bad_input, {"the compressed data", "size does not match"});
}
