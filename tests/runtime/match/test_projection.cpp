#include "runtime/src/match/sample_search.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

using namespace lbea;

TEST_CASE("coefficients are the rows of Psi' M times x, y and z") {
  std::mt19937 random(1);
  std::uniform_real_distribution<float> value(-1, 1);
  for (const std::size_t n : {1u, 2u, 15u, 16u, 17u, 1'300u})
    for (const std::size_t p : {1u, 3u, 100u}) {
      Positions positions(n), coefficients(p);
      for (auto& plane : positions.planes)
        for (std::size_t i = 0; i < n; ++i) plane[i] = 400 * value(random);
      std::vector<float> Vp(p * format::padded(n));
      for (std::size_t j = 0; j < p; ++j)
        for (std::size_t i = 0; i < n; ++i) Vp[j * format::padded(n) + i] = value(random);
      project(Vp, positions, coefficients);
      for (std::size_t axis = 0; axis < 3; ++axis)
        for (std::size_t j = 0; j < p; ++j) {
          double expected = 0, magnitude = 0;
          for (std::size_t i = 0; i < n; ++i) {
            const double term = double{Vp[j * format::padded(n) + i]} * double{positions.planes[axis][i]};
            expected += term;
            magnitude += std::abs(term);
          }
          // Rounding of a float sum of n terms: at most n eps times the sum of magnitudes, in practice far less.
          CHECK(std::abs(coefficients.planes[axis][j] - expected) <= 1e-6 * magnitude + 1e-12);
        }
    }
}
