#include "tests/clouds/cloud_support.hpp"
#include "tests/support/test_data.hpp"

#include <doctest/doctest.h>

#include <cstring>
#include <fstream>
#include <iterator>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

/// The three floats at the head of row `row`, found without the reader: rows end with the file.
Point row_of(const std::string& text, std::size_t rows, std::size_t stride, std::size_t row) {
  Point point{};
  std::memcpy(&point, text.data() + text.size() - (rows - row) * stride, sizeof point);
  return point;
}

void check_rows(const std::filesystem::path& path, std::size_t rows, std::size_t stride) {
  std::ifstream in(path, std::ios::binary);
  const std::string text{std::istreambuf_iterator<char>(in), {}};
  const PointCloud cloud = read_point_cloud(path);
  REQUIRE(cloud.points.size() == rows);
  std::vector<Point> expected(rows);
  for (std::size_t row = 0; row < rows; ++row) expected[row] = row_of(text, rows, stride, row);
  CHECK(same(cloud.points, expected));
}

}  // namespace

TEST_CASE("a LiDAR cloud with an extra property") {
  check_rows(reference_data() / "clouds/lidar.ply", 69'792, 16);
  CHECK_FALSE(read_point_cloud(reference_data() / "clouds/lidar.ply").stamp_ns.has_value());
}

TEST_CASE("a frame of the stereo sensor, with its stamp") {
  check_rows(reference_data() / "rail/frames/run_013_step02.ply", 88'077, 12);
  CHECK(read_point_cloud(reference_data() / "rail/frames/run_013_step02.ply").stamp_ns == 1'000'050);
}
