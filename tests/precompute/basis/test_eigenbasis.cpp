#include "precompute/basis/eigenbasis.hpp"

#include "tests/precompute/meshes.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

// The definition of the basis, checked independently of the solver.
void check_definition(const MeshLaplacian& laplacian, const Eigenbasis& basis, std::uint32_t p) {
  REQUIRE(basis.modes.cols() == p);
  REQUIRE(basis.eigenvalues.size() == p);
  const Eigen::MatrixXd& psi = basis.modes;
  const Eigen::MatrixXd gram = psi.transpose() * laplacian.mass.asDiagonal() * psi;
  CHECK((gram - Eigen::MatrixXd::Identity(p, p)).cwiseAbs().maxCoeff() < 1e-12);
  const Eigen::MatrixXd mass_psi = laplacian.mass.asDiagonal() * psi;
  const Eigen::MatrixXd defect = laplacian.stiffness * psi - mass_psi * basis.eigenvalues.asDiagonal();
  const double scale = std::max(basis.eigenvalues[p - 1], 4 * std::numbers::pi / laplacian.mass.sum());
  const double residual =
      (laplacian.mass.cwiseSqrt().cwiseInverse().asDiagonal() * defect).colwise().norm().maxCoeff() / scale;
  CHECK(residual < 1e-10);
  CHECK(basis.residual == doctest::Approx(residual).epsilon(0.5).scale(1e-12));
  for (Eigen::Index j = 1; j < p; ++j) CHECK(basis.eigenvalues[j - 1] <= basis.eigenvalues[j]);
  for (Eigen::Index j = 0; j < p; ++j) {
    const double largest = psi.col(j).cwiseAbs().maxCoeff();
    Eigen::Index first = 0;
    while (std::abs(psi(first, j)) < (1 - 1e-9) * largest) ++first;
    CHECK(psi(first, j) > 0);
  }
}

// Eigenvalues of the dense generalised problem, an independent solver.
Eigen::VectorXd dense_eigenvalues(const MeshLaplacian& laplacian) {
  const Eigen::MatrixXd mass = laplacian.mass.asDiagonal();
  return Eigen::GeneralizedSelfAdjointEigenSolver<Eigen::MatrixXd>(Eigen::MatrixXd(laplacian.stiffness), mass,
                                                                   Eigen::EigenvaluesOnly)
      .eigenvalues();
}

void check_against_dense(const Surface& surface, std::uint32_t p) {
  CAPTURE(p);
  const MeshLaplacian laplacian = laplacian_of(surface);
  const Eigenbasis basis = eigenbasis(laplacian, p);
  check_definition(laplacian, basis, p);
  const Eigen::VectorXd expected = dense_eigenvalues(laplacian);
  const double rounding = 1e-13 * expected.maxCoeff();
  CHECK((basis.eigenvalues - expected.head(p)).cwiseAbs().maxCoeff() < rounding);
}

Surface several_plates(std::uint32_t count) {
  Surface plates;
  for (std::uint32_t i = 0; i < count; ++i) append(plates, rectangle(8, 1.5, 1), 2.0 * i);
  return plates;
}

}  // namespace

TEST_CASE("the basis satisfies its definition and has the dense solver's eigenvalues, on both paths") {
  for (const std::uint32_t p : {1u, 2u, 7u, 60u})
    check_against_dense(rectangle(20, 3, 2, 0.3), p);  // 441 vertices: Krylov
  for (const std::uint32_t p : {1u, 2u, 80u, 81u})
    check_against_dense(rectangle(8, 3, 2, 0.3), p);   // 81: dense, up to p = n
  check_against_dense(rectangle(18, 3, 2, 0.3), 361);  // p = n beyond the dense limit
  check_against_dense(rectangle(18, 3, 2, 0.3), 180);  // just under half
}

TEST_CASE("equal eigenvalues are all found") {
  check_against_dense(rectangle(20, 1, 1), 2);  // a square: cuts the pair (1,0), (0,1)
  check_against_dense(rectangle(20, 1, 1), 3);
  check_against_dense(sphere(3), 30);
  check_against_dense(open_cylinder(30, 12, 1, 2), 25);
}

TEST_CASE("every component has its own constant mode") {
  for (const std::uint32_t components : {2u, 5u, 9u}) {
    const Surface plates = several_plates(components);
    const MeshLaplacian laplacian = laplacian_of(plates);
    const std::uint32_t p = 6 * components;
    const Eigenbasis basis = eigenbasis(laplacian, p);
    check_definition(laplacian, basis, p);
    const Eigenbasis alone = eigenbasis(laplacian_of(rectangle(8, 1.5, 1)), 6);
    const double lowest = alone.eigenvalues[1];
    for (Eigen::Index j = 0; j < p; ++j) {
      const double expected = alone.eigenvalues[j / components];  // each as often as there are plates
      CHECK(std::abs(basis.eigenvalues[j] - expected) <
            1e-6 * lowest);  // positions of shifted plates round differently
    }
  }
}

TEST_CASE("fewer modes than components") { check_against_dense(several_plates(5), 3); }

TEST_CASE("the same mesh has the same basis, bit for bit") {
  const MeshLaplacian laplacian = laplacian_of(sphere(3));
  const Eigenbasis first = eigenbasis(laplacian, 20), second = eigenbasis(laplacian, 20);
  CHECK(first.modes == second.modes);
  CHECK(first.eigenvalues == second.eigenvalues);
}

TEST_CASE("Sylvester counts what the dense solver lists") {
  const MeshLaplacian laplacian = laplacian_of(rectangle(9, 3, 2, 0.3));
  const Eigen::VectorXd scale = laplacian.mass.cwiseSqrt().cwiseInverse();
  const Eigen::SparseMatrix<double> a = scale.asDiagonal() * laplacian.stiffness * scale.asDiagonal();
  const Eigen::VectorXd values = dense_eigenvalues(laplacian);
  for (Eigen::Index i = 0; i + 1 < values.size(); i += 7)
    CHECK(eigenvalues_below(a, (values[i] + values[i + 1]) / 2) == i + 1);
  CHECK(eigenvalues_below(a, -1) == 0);
}

TEST_CASE("invalid input is refused with a sentence") {
  const MeshLaplacian laplacian = laplacian_of(rectangle(2, 1, 1));
  CHECK_THROWS_WITH_AS((void)eigenbasis(laplacian, 10), doctest::Contains("10 modes asked of a region with 9 vertices"),
                       Error);
  CHECK_THROWS_WITH_AS((void)eigenbasis(laplacian, 0), doctest::Contains("ask for 1 to 9"), Error);
  Surface lonely = rectangle(2, 1, 1);
  lonely.add(9, 9, 9);
  CHECK_THROWS_WITH_AS((void)eigenbasis(laplacian_of(lonely), 2), doctest::Contains("no surface around it"), Error);
}

// The residual was 8e-3 with a gap of 1e-6, without a warning.
TEST_CASE("very narrow elements: the modes are polished") {
  for (const float gap : {1e-3f, 1e-4f, 1e-6f}) {
    CAPTURE(gap);
    Surface surface = rectangle(20, 20, 20);
    for (std::size_t v = 1; v < surface.vertices(); v += 21) surface.positions[3 * v] = gap;  // beside the edge x = 0
    const MeshLaplacian laplacian = laplacian_of(surface);
    const Eigenbasis basis = eigenbasis(laplacian, 8);
    // The stiffness beside the gap is 1 / gap, its mass about gap, and a mode's entries there are rounded relative to
    // their size, sqrt(gap).
    CHECK(basis.residual < 4 * 0x1p-52 * std::pow(double{gap}, -1.5) / basis.eigenvalues[7]);
    const Eigen::MatrixXd gram = basis.modes.transpose() * laplacian.mass.asDiagonal() * basis.modes;
    CHECK((gram - Eigen::MatrixXd::Identity(8, 8)).cwiseAbs().maxCoeff() < 1e-9);
    CHECK(basis.eigenvalues[1] == doctest::Approx(std::numbers::pi * std::numbers::pi / 400).epsilon(0.01));
  }
}
