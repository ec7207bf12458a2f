// Signals at equidistant times.
#include "tools/shared/rating/signal.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

using namespace lbea::tool;

TEST_CASE("values that are not finite and times that do not increase are left out") {
  constexpr double nan = std::numeric_limits<double>::quiet_NaN(), inf = std::numeric_limits<double>::infinity();
  const Signal signal =
      known_part(std::vector<double>{0, 1, 1, 0.5, 2, nan, 3, 4}, std::vector<double>{5, 6, 7, 8, nan, 9, inf, 10});
  CHECK(signal.times_s == std::vector<double>{0, 1, 4});
  CHECK(signal.values == std::vector<double>{5, 6, 10});
  CHECK(known_part(std::vector<double>{0, 1}, std::vector<double>{nan, nan}).empty());
}

TEST_CASE("a grid has the last time in spite of rounding, and none beyond it") {
  CHECK(grid_within(0, 0.3, 0.1).size == 4);  // 3 * 0.1 > 0.3 in doubles
  CHECK(grid_within(0, 0.29, 0.1).size == 3);
  CHECK(grid_within(0, 0, 0.1).size == 1);
  CHECK(grid_within(0.1, 0, 0.1).size == 0);
  CHECK(grid_within(-0.0123, 0.0877, 1e-4).size == 1001);
  CHECK(grid_within(-0.2, 0.3, 0.1).at(2) == doctest::Approx(0));
}

TEST_CASE("a signal is linear between its values and constant beyond them") {
  const Signal signal{{0, 1, 3}, {2, 4, -2}};
  CHECK(resampled(signal, {-1, 0.5, 10}) == std::vector<double>{2, 2, 2, 3, 4, 2.5, 1, -0.5, -2, -2});
  CHECK(resampled({{2}, {7}}, {0, 1, 4}) == std::vector<double>{7, 7, 7, 7});
}
