// Smooth surfaces with known eigenvalues: linear elements converge with the square of the edge length.
#include "precompute/basis/eigenbasis.hpp"
#include "tests/precompute/meshes.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

double largest_error(const Surface& surface, const std::vector<double>& expected) {
  const Eigenbasis basis = eigenbasis(laplacian_of(surface), static_cast<std::uint32_t>(expected.size()));
  double error = 0;
  for (std::size_t j = 1; j < expected.size(); ++j)
    error = std::max(error, std::abs(basis.eigenvalues[static_cast<Eigen::Index>(j)] / expected[j] - 1));
  CHECK(std::abs(basis.eigenvalues[0]) < 1e-10 * expected[1]);
  return error;
}

std::vector<double> lowest(std::vector<double> values, std::size_t count) {
  std::ranges::sort(values);
  values.resize(count);
  return values;
}

void check_second_order(double coarse, double fine, double bound) {
  CAPTURE(coarse);
  CAPTURE(fine);
  CHECK(fine < bound);
  const double order = std::log2(coarse / fine);
  CHECK(order > 1.8);
  CHECK(order < 2.2);
}

}  // namespace

TEST_CASE("a rectangle with free edges: pi^2 (i^2 / a^2 + j^2 / b^2)") {
  constexpr double a = 3, b = 2, pi = std::numbers::pi;
  std::vector<double> exact;
  for (int i = 0; i < 10; ++i)
    for (int j = 0; j < 10; ++j) exact.push_back(pi * pi * (i * i / (a * a) + j * j / (b * b)));
  const auto expected = lowest(exact, 15);
  check_second_order(largest_error(rectangle(20, a, b), expected), largest_error(rectangle(40, a, b), expected), 0.02);
}

TEST_CASE("the open side of a cylinder: (k / r)^2 + (pi m / h)^2, twice for k > 0") {
  constexpr double r = 1, h = 2.5, pi = std::numbers::pi;
  std::vector<double> exact;
  for (int k = 0; k < 10; ++k)
    for (int m = 0; m < 10; ++m) {
      const double value = k * k / (r * r) + pi * pi * m * m / (h * h);
      exact.push_back(value);
      if (k > 0) exact.push_back(value);
    }
  const auto expected = lowest(exact, 14);
  check_second_order(largest_error(open_cylinder(30, 12, r, h), expected),
                     largest_error(open_cylinder(60, 24, r, h), expected), 0.02);
}

TEST_CASE("the unit sphere: l (l + 1), 2 l + 1 times") {
  std::vector<double> expected;
  for (int l = 0; l < 4; ++l) expected.insert(expected.end(), static_cast<std::size_t>(2 * l + 1), l * (l + 1.0));
  check_second_order(largest_error(sphere(3), expected), largest_error(sphere(4), expected), 0.02);
}
