#include "precompute/basis/mesh_laplacian.hpp"

#include <lbea/lbea.hpp>

#include <Eigen/Geometry>

#include <algorithm>

namespace lbea::bake {
namespace {
// Height over longest side below which a triangle has no area: float positions do not resolve it, and its
// cotangents would drown all others.
constexpr double flattest_triangle = 1e-8;

using Triangle = std::array<std::uint32_t, 3>;

struct Assembly {
  std::span<const float> positions;
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd mass;
  std::size_t degenerate = 0;

  [[nodiscard]] Eigen::Vector3d position(std::uint32_t vertex) const {
    const float* p = &positions[3 * std::size_t{vertex}];
    return Eigen::Vector3d(double{p[0]}, double{p[1]}, double{p[2]});
  }

  void add_edge(std::uint32_t a, std::uint32_t b, double weight) {
    const auto i = static_cast<int>(a), j = static_cast<int>(b);
    entries.emplace_back(i, j, -weight);
    entries.emplace_back(j, i, -weight);
    entries.emplace_back(i, i, weight);
    entries.emplace_back(j, j, weight);
  }

  // Edge (j, k) opposite of corner i weighs cot(angle at i) / 2 = -(e_j . e_k) / (4 area), e_i opposite of i.
  void add(const Triangle& t) {
    const std::array<Eigen::Vector3d, 3> corners{position(t[0]), position(t[1]), position(t[2])};
    const std::array<Eigen::Vector3d, 3> edges{corners[2] - corners[1], corners[0] - corners[2],
                                               corners[1] - corners[0]};
    const double area = edges[0].cross(edges[1]).norm() / 2;
    const double longest = std::max({edges[0].squaredNorm(), edges[1].squaredNorm(), edges[2].squaredNorm()});
    if (!(2 * area > flattest_triangle * longest)) {
      ++degenerate;
      return;
    }
    for (std::size_t i = 0; i < 3; ++i) {
      const std::size_t j = (i + 1) % 3, k = (i + 2) % 3;
      add_edge(t[j], t[k], -edges[j].dot(edges[k]) / (4 * area));
      mass[t[i]] += area / 3;
    }
  }
};

void check_indices(const Quad& element, std::size_t number, std::size_t vertices) {
  for (const std::uint32_t node : element)
    if (node >= vertices)
      throw Error(Status::bad_input, "element " + std::to_string(number) + " of the reference mesh names vertex " +
                                         std::to_string(node) + ", but there are " + std::to_string(vertices));
}

bool has_distinct_nodes(const Triangle& t) { return t[0] != t[1] && t[1] != t[2] && t[2] != t[0]; }
}  // namespace

MeshLaplacian mesh_laplacian(std::span<const float> positions, std::span<const Quad> elements) {
  const std::size_t vertices = positions.size() / 3;
  const auto n = static_cast<Eigen::Index>(vertices);
  Assembly assembly{positions, {}, Eigen::VectorXd::Zero(n)};
  assembly.entries.reserve(24 * elements.size());
  for (std::size_t number = 0; number < elements.size(); ++number) {
    const Quad& q = elements[number];
    check_indices(q, number, vertices);
    for (const Triangle& t : {Triangle{q[0], q[1], q[2]}, Triangle{q[0], q[2], q[3]}})
      if (has_distinct_nodes(t)) assembly.add(t);
  }
  MeshLaplacian result{Eigen::SparseMatrix<double>(n, n), std::move(assembly.mass), assembly.degenerate};
  result.stiffness.setFromTriplets(assembly.entries.begin(), assembly.entries.end());
  return result;
}
}  // namespace lbea::bake
