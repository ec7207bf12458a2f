#include "tests/clouds/cloud_support.hpp"
#include "tests/support/test_data.hpp"

#include "adapters/files/atomic_file.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

const std::vector<Point> three{{1, 2, 3}, {-4, 5, -6}, {7, -8, 9}};  // whole numbers: every scalar type holds them
constexpr float quiet_nan = std::numeric_limits<float>::quiet_NaN();

/// The bytes of `value` in the order asked for.
template <class T>
std::string packed(T value, bool big_endian) {
  std::array<char, sizeof(T)> bytes{};
  std::memcpy(bytes.data(), &value, sizeof(T));
  if (big_endian) std::reverse(bytes.begin(), bytes.end());
  return {bytes.begin(), bytes.end()};
}

template <class T>
std::string rows(bool big_endian) {
  std::string text;
  for (const Point& p : three)
    for (const float value : {p.x, p.y, p.z}) text += packed(static_cast<T>(value), big_endian);
  return text;
}

std::string header(const std::string& format, const std::string& body) {
  return "ply\nformat " + format + " 1.0\n" + body + "end_header\n";
}

std::string vertex(const std::string& type, std::size_t count = 3) {
  return "element vertex " + std::to_string(count) + "\nproperty " + type + " x\nproperty " + type + " y\nproperty " +
         type + " z\n";
}

template <class T>
void check_type(const std::string& type) {
  for (const bool big_endian : {false, true}) {
    const std::string format = big_endian ? "binary_big_endian" : "binary_little_endian";
    CAPTURE(type);
    CAPTURE(format);
    CHECK(same(parse_ply(bytes_of(header(format, vertex(type)) + rows<T>(big_endian)), "t").points, three));
  }
}

PointCloud parse(const std::string& text) { return parse_ply(bytes_of(text), "t.ply"); }

}  // namespace

TEST_CASE("every scalar type of a signed kind, in both byte orders") {
  check_type<float>("float");
  check_type<double>("double");
  check_type<std::int8_t>("char");
  check_type<std::int16_t>("short");
  check_type<std::int32_t>("int");
  check_type<float>("float32");
  check_type<double>("float64");
  check_type<std::int8_t>("int8");
  check_type<std::int16_t>("int16");
  check_type<std::int32_t>("int32");
}

TEST_CASE("unsigned types keep their top bit") {
  const std::string text =
      header("binary_little_endian", "element vertex 1\nproperty uchar x\nproperty ushort y\nproperty uint z\n") +
      packed(std::uint8_t{200}, false) + packed(std::uint16_t{60000}, false) +
      packed(std::uint32_t{4'000'000'000u}, false);
  CHECK(same(parse(text).points, {{200, 60000, 4e9f}}));
}

TEST_CASE("axes in another order, and lists whose counts have a sign") {
  for (const bool big_endian : {false, true}) {
    const auto p = [&](auto value) { return packed(value, big_endian); };
    const std::string format = big_endian ? "binary_big_endian" : "binary_little_endian";
    CHECK(same(parse(header(format, "element vertex 1\nproperty float z\nproperty float y\nproperty float x\n") +
                     p(3.f) + p(2.f) + p(1.f))
                   .points,
               {{1, 2, 3}}));
    const std::string lists = "property list int8 uchar a\nproperty list int16 uchar b\nproperty float w\n";
    CHECK(same(parse(header(format, vertex("float", 1) + lists) + p(1.f) + p(2.f) + p(3.f) + p(std::int8_t{1}) + "a" +
                     p(std::int16_t{2}) + "bb" + p(0.f))
                   .points,
               {{1, 2, 3}}));
    for (const std::string& count : {p(std::int8_t{-1}), p(std::int8_t{0}) + p(std::int16_t{-1})})
      check_error(error_of([&] {
                    static_cast<void>(parse(header(format, vertex("float", 1) + lists) + p(1.f) + p(2.f) + p(3.f) +
                                            count + std::string(300, 'x')));
                  }),
                  Status::bad_input, {"t.ply, byte", "negative count"});
  }
}

TEST_CASE("sizes 0, 1, 2, many come back as written, in ASCII and binary") {
  for (const std::size_t size : {0u, 1u, 2u, 1000u}) {
    std::vector<Point> points(size);
    for (std::size_t i = 0; i < size; ++i) {
      const auto f = static_cast<float>(i);
      points[i] = {f * 0.1f, -f / 3, 1e-20f * f};
    }
    const TemporaryFolder folder;
    write_ply(folder / "cloud.ply", points, std::vector<std::string>{"length unit mm, stamp_ns -12"});
    const PointCloud cloud = read_point_cloud(folder / "cloud.ply");
    CHECK(same(cloud.points, points));
    CHECK(cloud.stamp_ns == -12);
    CHECK(cloud.source == (folder / "cloud.ply").string());

    std::string ascii = header("ascii", vertex("float", size));
    std::array<char, 64> line{};
    for (const Point& p : points) {
      std::snprintf(line.data(), line.size(), "%.9g %.9g %.9g\n", double{p.x}, double{p.y}, double{p.z});
      ascii += line.data();
    }
    CHECK(same(parse(ascii).points, points));  // nine digits tell floats apart
  }
}

TEST_CASE("other properties, lists and elements around the points are skipped") {
  const std::string body =
      "element camera 1\nproperty float fov\nproperty list uchar int ids\n"
      "element empty 5\n"
      "element vertex 2\nproperty uchar quality\nproperty double z\nproperty list ushort double w\n"
      "property float x\nproperty list uint uchar name\nproperty short y\nproperty float intensity\n"
      "element face 1\nproperty list uchar int vertex_indices\n";
  for (const bool big_endian : {false, true}) {
    const auto p = [&](auto value) { return packed(value, big_endian); };
    std::string text = header(big_endian ? "binary_big_endian" : "binary_little_endian", body);
    text += p(60.f) + p(std::uint8_t{2}) + p(7) + p(8);
    text += p(std::uint8_t{9}) + p(3.0) + p(std::uint16_t{1}) + p(0.5) + p(1.f) + p(2u) + "ab" + p(std::int16_t{2}) +
            p(0.f);
    text += p(std::uint8_t{9}) + p(-6.0) + p(std::uint16_t{0}) + p(-4.f) + p(0u) + p(std::int16_t{5}) + p(0.f);
    text += p(std::uint8_t{3}) + p(0) + p(1) + p(0);
    CHECK(same(parse(text).points, {{1, 2, 3}, {-4, 5, -6}}));
  }
  const std::string ascii = header("ascii", body) + "60 2 7 8\n9 3 1 0.5 1 2 97 98 2 0\n9 -6 0 -4 0 5 0\n3 0 1 0\n";
  CHECK(same(parse(ascii).points, {{1, 2, 3}, {-4, 5, -6}}));
}

TEST_CASE("line ends, blanks, signs, NaN and the stamp") {
  std::string text = header("ascii", "comment a stamp_ns: 1000050 b\nobj_info x stamp_ns 7\n" + vertex("double")) +
                     "  1\t2  3 \n\n+4e0 -.5 NaN\nnan inf 1e-60";
  const std::vector<Point> expected{
      {1, 2, 3}, {4, -0.5f, quiet_nan}, {quiet_nan, std::numeric_limits<float>::infinity(), 0}};
  CHECK(same(parse(text).points, expected));
  CHECK(parse(text).stamp_ns == 1000050);
  std::string windows;
  for (const char c : text) windows += c == '\n' ? std::string("\r\n") : std::string(1, c);
  CHECK(same(parse(windows).points, expected));
  CHECK(parse(windows).stamp_ns == 1000050);
  CHECK_FALSE(parse(header("ascii", "comment stamp_ns soon\n" + vertex("float", 0))).stamp_ns.has_value());
  CHECK_FALSE(parse(header("ascii", "comment stamp_ns\n" + vertex("float", 0))).stamp_ns.has_value());

  const std::string binary =
      "ply\r\nformat binary_little_endian 1.0\r\nelement vertex 3\r\nproperty float x\r\n"
      "property float y\r\nproperty float z\r\nend_header\r\n" +
      rows<float>(false);
  CHECK(same(parse(binary).points, three));
}

TEST_CASE("writing") {
  const TemporaryFolder folder;
  const std::vector<std::string> comments{"one", "two"};
  write_ply(folder / "cloud.ply", three, comments);
  const std::string expected =
      header("binary_little_endian", "comment one\ncomment two\n" + vertex("float")) + rows<float>(false);
  CHECK(as_text(read_file(folder / "cloud.ply")) == expected);

  const std::vector<std::string> broken{"one\nelement vertex 9"};
  CHECK(error_of([&] { write_ply(folder / "broken.ply", three, broken); }).status == Status::bad_config);
  CHECK_FALSE(std::filesystem::exists(folder / "broken.ply"));
  CHECK(error_of([&] { write_ply(folder / "no/cloud.ply", three, {}); }).status == Status::write_failed);
}
