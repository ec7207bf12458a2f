#include "precompute/dense/block_update.hpp"
#include "precompute/dense/symmetric_inverse.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

using namespace lbea::bake;
using Eigen::Index, Eigen::MatrixXd;

namespace {

/// Kernel matrix of points on a curve, with `ridge` on the diagonal: eigenvalues from ridge to n + ridge.
MatrixXd kernel_matrix(Index n, double ridge) {
  MatrixXd matrix(n, n);
  for (Index i = 0; i < n; ++i)
    for (Index j = 0; j < n; ++j) matrix(i, j) = 1 / std::sqrt(1 + std::pow(0.05 * static_cast<double>(i - j), 2));
  matrix.diagonal().array() += ridge;
  return matrix;
}

}  // namespace

TEST_CASE("the inverse times the matrix is the identity, for whole blocks and parts of them") {
  constexpr double ridge = 1e-3, epsilon = 2.3e-16;
  for (const Index n : {1, 3, 63, 64, 65, 200}) {
    const MatrixXd matrix = kernel_matrix(n, ridge), inverse = inverse_of_symmetric(matrix);
    const double condition = (static_cast<double>(n) + ridge) / ridge;
    const double error = (inverse * matrix - MatrixXd::Identity(n, n)).norm();
    // n condition epsilon in the 2-norm (Higham 2002, section 14), of which this one is up to sqrt(n) times
    CHECK(error < std::sqrt(static_cast<double>(n)) * static_cast<double>(n) * condition * epsilon);
    CHECK(inverse == inverse.transpose());
  }
}

TEST_CASE("the update of a block is the same on all instruction sets, bit by bit") {
  constexpr std::size_t size = 3 * BlockSizes::columns, depth = BlockSizes::sweep;
  std::vector<double> w(size * depth), v(depth * size), start(size * size);
  for (std::size_t i = 0; i < w.size(); ++i)
    w[i] = std::sin(static_cast<double>(i)), v[i] = std::cos(1.7 * static_cast<double>(i));
  for (std::size_t i = 0; i < start.size(); ++i) start[i] = std::sin(0.3 * static_cast<double>(i));
  std::vector<double> expected = start;
  for (std::size_t row = 0; row < size; ++row)
    for (std::size_t column = 0; column < size; ++column)
      for (std::size_t k = 0; k < depth; ++k) {
        const std::size_t group = row / BlockSizes::rows * BlockSizes::rows;
        const double product = w[group * depth + k * BlockSizes::rows + row % BlockSizes::rows] * v[k * size + column];
        expected[row * size + column] -= product;
      }
  std::size_t count = 0;
  for (const BlockUpdate* update = block_updates(); *update != nullptr; ++update, ++count) {
    std::vector<double> all = start, lower = start;
    (*update)(size, size, false, w.data(), v.data(), all.data());
    CHECK(all == expected);
    (*update)(size, size, true, w.data(), v.data(), lower.data());
    for (std::size_t row = 0; row < size; ++row)
      for (std::size_t column = 0; column <= row; ++column)
        REQUIRE(lower[row * size + column] == expected[row * size + column]);
  }
  CHECK(count >= 1);
}
