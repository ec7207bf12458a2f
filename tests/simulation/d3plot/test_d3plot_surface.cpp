// Outer faces of solids: closed, outward, and only those that one solid owns.
#include <doctest/doctest.h>

#include <algorithm>
#include <map>

#include "adapters/simulation/surface.hpp"
#include "tests/support/d3plot_writer.hpp"

using lbea::io::Hexahedron;
using lbea::io::Quad;
using lbea::io::shell_faces;
using lbea::io::solid_faces;

namespace {

using Point = std::array<double, 3>;

/// The volume inside a closed surface, by the divergence theorem over triangles 0-1-2 and 0-2-3.
double volume(const std::vector<lbea::io::SurfaceElement>& faces, const std::vector<Point>& points) {
  const auto determinant = [&](std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    const Point &a = points[i], &b = points[j], &c = points[k];
    return a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  };
  double sum = 0;
  for (const auto& face : faces)
    sum += determinant(face.nodes[0], face.nodes[1], face.nodes[2]) +
           determinant(face.nodes[0], face.nodes[2], face.nodes[3]);
  return sum / 6;
}

/// In a closed oriented surface every directed edge stands against exactly one in the other direction.
bool is_closed(const std::vector<lbea::io::SurfaceElement>& faces) {
  std::map<std::pair<std::uint32_t, std::uint32_t>, int> edges;
  for (const auto& face : faces)
    for (std::size_t c = 0; c < 4; ++c) {
      const std::uint32_t from = face.nodes[c], to = face.nodes[(c + 1) % 4];
      if (from != to) edges[{from, to}] += 1;
    }
  return std::all_of(edges.begin(), edges.end(), [&](const auto& edge) {
    const auto opposite = edges.find({edge.first.second, edge.first.first});
    return opposite != edges.end() && opposite->second == edge.second;
  });
}

const std::vector<Point> cube{{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 1}, {1, 1, 1}, {0, 1, 1}};

}  // namespace

TEST_CASE("no solid, one brick, two bricks") {
  CHECK(solid_faces({}).outer.empty());
  const std::vector<Hexahedron> one{{0, 1, 2, 3, 4, 5, 6, 7}};
  CHECK(solid_faces(one).outer.size() == 6);
  CHECK(is_closed(solid_faces(one).outer));
  CHECK(volume(solid_faces(one).outer, cube) == doctest::Approx(1));

  std::vector<Point> points = cube;
  points.insert(points.end(), {{0, 0, 3}, {1, 0, 3}, {1, 1, 3}, {0, 1, 3}});
  const std::vector<Hexahedron> two{{0, 1, 2, 3, 4, 5, 6, 7}, {4, 5, 6, 7, 8, 9, 10, 11}};
  const auto faces = solid_faces(two).outer;
  CHECK(faces.size() == 10);
  CHECK(is_closed(faces));
  CHECK(volume(faces, points) == doctest::Approx(3));
  CHECK(std::is_sorted(faces.begin(), faces.end(), [](const auto& a, const auto& b) { return a.source < b.source; }));
}

TEST_CASE("a brick cut out of a 3 x 3 x 3 block leaves 54 outer and 6 inner faces") {
  const auto node = [](std::uint32_t x, std::uint32_t y, std::uint32_t z) { return x + 4 * (y + 4 * z); };
  std::vector<Point> points;
  for (int z = 0; z < 4; ++z)
    for (int y = 0; y < 4; ++y)
      for (int x = 0; x < 4; ++x) points.push_back({1.0 * x, 1.0 * y, 1.0 * z});
  std::vector<Hexahedron> solids;
  for (std::uint32_t z = 0; z < 3; ++z)
    for (std::uint32_t y = 0; y < 3; ++y)
      for (std::uint32_t x = 0; x < 3; ++x)
        if (x != 1 || y != 1 || z != 1)
          solids.push_back({node(x, y, z), node(x + 1, y, z), node(x + 1, y + 1, z), node(x, y + 1, z),
                            node(x, y, z + 1), node(x + 1, y, z + 1), node(x + 1, y + 1, z + 1),
                            node(x, y + 1, z + 1)});
  const auto faces = solid_faces(solids).outer;
  CHECK(faces.size() == 60);
  CHECK(is_closed(faces));
  CHECK(volume(faces, points) == doctest::Approx(26));
}

TEST_CASE("tetrahedra, pyramids and both ways to write a wedge") {
  struct Case {
    Hexahedron solid;
    std::size_t faces;
    double volume;
  };
  for (const Case& c : {Case{{0, 1, 2, 4, 4, 4, 4, 4}, 4, 1.0 / 6}, Case{{0, 1, 2, 2, 4, 4, 4, 4}, 4, 1.0 / 6},
                        Case{{0, 1, 2, 3, 4, 4, 4, 4}, 5, 1.0 / 3}, Case{{0, 1, 2, 2, 4, 5, 6, 6}, 5, 0.5},
                        Case{{0, 1, 5, 4, 3, 3, 7, 7}, 5, -0.5}, Case{{4, 5, 1, 0, 7, 7, 3, 3}, 5, 0.5}}) {
    const auto faces = solid_faces(std::vector<Hexahedron>{c.solid}).outer;
    CHECK(faces.size() == c.faces);
    CHECK(is_closed(faces));
    CHECK(volume(faces, cube) == doctest::Approx(c.volume));
  }
  CHECK(solid_faces(std::vector<Hexahedron>{{0, 0, 0, 0, 0, 0, 0, 0}}).outer.empty());
}

TEST_CASE("five tetrahedra that fill the cube leave its twelve triangles") {
  const std::vector<Hexahedron> solids{{0, 1, 3, 4, 4, 4, 4, 4},
                                       {1, 2, 3, 6, 6, 6, 6, 6},
                                       {1, 6, 4, 5, 5, 5, 5, 5},
                                       {3, 4, 6, 7, 7, 7, 7, 7},
                                       {1, 3, 4, 6, 6, 6, 6, 6}};
  const auto faces = solid_faces(solids).outer;
  CHECK(faces.size() == 12);
  for (const auto& face : faces) CHECK(face.nodes[2] == face.nodes[3]);
}

TEST_CASE("brick, wedge and tetrahedron side by side") {
  const lbea::test::D3plot sample = lbea::test::sample_d3plot(0);
  const auto faces = solid_faces(sample.solids).outer;
  CHECK(faces.size() == 11);
  CHECK(is_closed(faces));
  CHECK(volume(faces, sample.nodes) == doctest::Approx(1 + 0.5 + 1.0 / 6));
}

TEST_CASE("shells keep their order; triangles repeat the last node; degenerate ones are left out") {
  const std::vector<Quad> shells{{0, 1, 2, 3}, {0, 1, 2, 2}, {0, 0, 1, 2}, {0, 1, 1, 2},
                                 {2, 1, 0, 2}, {0, 1, 0, 1}, {0, 1, 0, 2}, {5, 5, 5, 5}};
  const auto faces = shell_faces(shells);
  REQUIRE(faces.size() == 5);
  CHECK(faces[0].nodes == Quad{0, 1, 2, 3});
  for (std::size_t f = 1; f < 5; ++f) {
    CHECK(faces[f].source == f);
    CHECK(faces[f].nodes[2] == faces[f].nodes[3]);
  }
  CHECK(faces[2].nodes == Quad{0, 1, 2, 2});
  CHECK(faces[4].nodes == Quad{2, 1, 0, 0});
  CHECK(shell_faces({}).empty());
}
