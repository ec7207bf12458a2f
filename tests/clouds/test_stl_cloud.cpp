#include "tests/clouds/cloud_support.hpp"

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::io;
using namespace lbea::test;

namespace {

const std::string two_triangles =
    "solid part\n facet normal 0 0 1\n  outer loop\n   vertex 5 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n "
    "endfacet\n"
    " facet normal 0 0 1\n  outer loop\n   vertex 1 0 0\n   vertex 1 1 2.5e-1\n   vertex 0 1 0\n  endloop\n "
    "endfacet\nendsolid part\n";

PointCloud parse_stl(const std::string& bytes) { return parse_point_cloud(bytes_of(bytes), "a.stl"); }

}  // namespace

TEST_CASE("the corners of STL triangles are points, each once, in the order of the file") {
  const std::vector<Point> corners{{5, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0.25f}};
  CHECK(same(parse_stl(two_triangles).points, corners));
  std::string binary(80, 's');
  const auto add = [&](auto value) { binary.append(reinterpret_cast<const char*>(&value), sizeof value); };
  add(std::uint32_t{2});
  for (const auto& triangle : {std::array{0, 1, 2}, {1, 3, 2}}) {
    for (int i = 0; i < 3; ++i) add(0.0f);
    for (const int corner : triangle) add(corners[static_cast<std::size_t>(corner)]);
    add(std::uint16_t{0});
  }
  CHECK(same(parse_stl(binary).points, corners));
  CHECK(error_of([&] { (void)parse_stl(binary.substr(0, 150)); }).status == Status::unsupported_input);
}

TEST_CASE("broken STL text is refused with the line") {
  check_error(error_of([&] { (void)parse_stl(two_triangles.substr(0, two_triangles.find("   vertex 1 1"))); }),
              Status::bad_input, {"a.stl", "cut short"});
  check_error(error_of([&] { (void)parse_stl("solid\nfacet\nvertex 1 2\n"); }), Status::bad_input,
              {"line 3", "three numbers"});
  check_error(error_of([&] { (void)parse_stl("solid\nfacet\nvertex 1 2 3\nendfacet\n"); }), Status::bad_input,
              {"line 4"});
}
