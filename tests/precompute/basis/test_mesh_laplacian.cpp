#include "tests/precompute/meshes.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>
#include <Eigen/Dense>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

// Positions are single precision: lengths carry a relative error of up to 2^-24, areas about twice that.
constexpr double float_epsilon = 6e-8;

double energy(const MeshLaplacian& laplacian, const Eigen::VectorXd& f) { return f.dot(laplacian.stiffness * f); }

Eigen::VectorXd coordinate(const Surface& surface, std::size_t axis) {
  Eigen::VectorXd f(static_cast<Eigen::Index>(surface.vertices()));
  for (Eigen::Index i = 0; i < f.size(); ++i)
    f[i] = static_cast<double>(surface.positions[3 * static_cast<std::size_t>(i) + axis]);
  return f;
}

}  // namespace

TEST_CASE("a right triangle has the values computed by hand") {
  const Surface surface{{0, 0, 0, 1, 0, 0, 0, 1, 0}, {{0, 1, 2, 2}}};
  const MeshLaplacian laplacian = laplacian_of(surface);
  // cot 90 = 0 at vertex 0, cot 45 = 1 at the others: the legs weigh 1/2, the hypotenuse nothing.
  Eigen::Matrix3d expected;
  expected << 1, -0.5, -0.5, -0.5, 0.5, 0, -0.5, 0, 0.5;
  CHECK((Eigen::Matrix3d(laplacian.stiffness) - expected).norm() < 1e-15);
  CHECK((laplacian.mass - Eigen::Vector3d::Constant(1.0 / 6)).norm() < 1e-15);
  CHECK(laplacian.degenerate_triangles == 0);
}

TEST_CASE("L is symmetric and positive semi-definite, its rows sum to zero, M sums to the area") {
  for (const Surface& surface : {rectangle(8, 3, 2, 0.3), open_cylinder(12, 5, 2, 7), sphere(2)}) {
    const MeshLaplacian laplacian = laplacian_of(surface);
    const Eigen::MatrixXd l(laplacian.stiffness);
    const double scale = l.cwiseAbs().maxCoeff();
    CHECK((l - l.transpose()).cwiseAbs().maxCoeff() < 1e-14 * scale);
    CHECK(l.rowwise().sum().cwiseAbs().maxCoeff() < 1e-13 * scale);
    CHECK(Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(l).eigenvalues().minCoeff() > -1e-13 * scale);
    CHECK(laplacian.mass.minCoeff() > 0);
  }
  CHECK(laplacian_of(rectangle(8, 3, 2, 0.3)).mass.sum() == doctest::Approx(6).epsilon(4 * float_epsilon));
  const double side = 2 * 2 * std::sin(std::numbers::pi / 12);  // chord of a twelfth of the circle of radius 2
  CHECK(laplacian_of(open_cylinder(12, 5, 2, 7)).mass.sum() ==
        doctest::Approx(12 * side * 7).epsilon(4 * float_epsilon));
}

TEST_CASE("a linear function on a flat mesh has the Dirichlet energy slope^2 x area, whatever the triangles") {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) {
    const Surface surface = rectangle(7, 3, 2, 0.35, seed);
    const MeshLaplacian laplacian = laplacian_of(surface);
    const Eigen::VectorXd f = 2 * coordinate(surface, 0) - 5 * coordinate(surface, 1);
    CHECK(energy(laplacian, f) == doctest::Approx((4 + 25) * 6.0).epsilon(1e-6));
  }
}

TEST_CASE("three sheets at one edge add up") {
  Surface joint = rectangle(3, 1, 1);
  const std::uint32_t low = 0, high = 12;  // the edge x = 0
  const std::uint32_t up_low = joint.add(0, 0, 1), up_high = joint.add(0, 1, 1);
  const std::uint32_t left_low = joint.add(-1, 0, 0), left_high = joint.add(-1, 1, 0);
  const Surface sheet = joint;
  joint.elements.push_back({low, up_low, up_high, high});
  joint.elements.push_back({low, left_low, left_high, high});
  Surface up = sheet, left = sheet;
  up.elements = {joint.elements[9]};
  left.elements = {joint.elements[10]};
  const MeshLaplacian whole = laplacian_of(joint), a = laplacian_of(sheet), b = laplacian_of(up),
                      c = laplacian_of(left);
  CHECK(Eigen::MatrixXd(whole.stiffness - a.stiffness - b.stiffness - c.stiffness).cwiseAbs().maxCoeff() < 1e-14);
  CHECK((whole.mass - a.mass - b.mass - c.mass).cwiseAbs().maxCoeff() < 1e-15);
  CHECK(whole.mass.sum() == doctest::Approx(3).epsilon(4 * float_epsilon));
}

TEST_CASE("triangles without area are skipped and counted") {
  Surface surface = rectangle(2, 2, 2);
  const Eigen::MatrixXd before(laplacian_of(surface).stiffness);
  surface.elements.push_back({0, 1, 2, 2});  // on one line
  const MeshLaplacian after = laplacian_of(surface);
  CHECK(after.degenerate_triangles == 1);
  CHECK(Eigen::MatrixXd(after.stiffness) == before);
}

TEST_CASE("a triangle's repeated node is not a degenerate triangle") {
  CHECK(laplacian_of(sphere(1)).degenerate_triangles == 0);
}

TEST_CASE("a vertex without elements has no mass; an index beyond the vertices is refused") {
  Surface surface = rectangle(1, 1, 1);
  surface.add(5, 5, 5);
  CHECK(laplacian_of(surface).mass[4] == 0);
  surface.elements.push_back({0, 1, 5, 5});
  CHECK_THROWS_WITH_AS(laplacian_of(surface), doctest::Contains("names vertex 5, but there are 5"), Error);
}

TEST_CASE("without elements the stiffness is empty") {
  const MeshLaplacian laplacian = mesh_laplacian({}, {});
  CHECK(laplacian.mass.size() == 0);
  CHECK(laplacian.stiffness.nonZeros() == 0);
}
