// The elementary functions against those of the C library in a wider type.
#include "runtime/src/numbers/elementary.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

using namespace lbea;

namespace {
constexpr double infinity = std::numeric_limits<double>::infinity();

/// Distance from the exact value in units in the last place of a number of this size.
template <typename Number>
double error(Number value, long double exact) {
  const Number size = std::max(std::abs(static_cast<Number>(exact)), std::numeric_limits<Number>::min());
  const Number unit = std::nextafter(size, std::numeric_limits<Number>::infinity()) - size;
  return static_cast<double>(std::abs(static_cast<long double>(value) - exact) / static_cast<long double>(unit));
}

/// The greatest error for `count` random arguments in [low, high], and at these.
template <typename Function, typename Oracle>
double worst(double low, double high, Function function, Oracle oracle) {
  constexpr int count = 20'000;
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> anywhere(low, high);
  double greatest = 0;
  for (int i = 0; i < count + 2; ++i) {
    const double x = i == count ? low : i > count ? high : anywhere(random);
    greatest = std::max(greatest, error(function(x), oracle(static_cast<long double>(x))));
  }
  return greatest;
}
}  // namespace

TEST_CASE("elementary functions err by about one unit in the last place") {
  const auto exp = [](long double x) { return std::exp(x); };
  const auto log = [](long double x) { return std::log(x); };
  const auto sin = [](long double x) { return std::sin(x); };
  CHECK(worst(-1, 1, exponential, exp) < 1);
  CHECK(worst(-700, 709, exponential, exp) < 1);
  CHECK(worst(-745, -700, exponential, exp) < 1);  // down to denormal numbers
  CHECK(worst(0.5, 2, logarithm, log) < 1);
  CHECK(worst(1e-300, 1e-290, logarithm, log) < 1);
  CHECK(worst(1, 1e300, logarithm, log) < 1);
  CHECK(logarithm(5e-324) == std::log(5e-324));
  // Roundings of the sum (1/2), the argument less a quarter turn (1/2) and its square (1/4).
  CHECK(worst(-0.8, 0.8, sine, sin) < 1.25);
  CHECK(worst(-3, 3, sine, sin) < 1.25);
  const auto root = [](double x) { return cube_root(static_cast<float>(x)); };
  const auto cbrt = [](long double x) { return std::cbrt(static_cast<long double>(static_cast<float>(x))); };
  CHECK(worst(1e-30, 1e-20, root, cbrt) < 0.51);
  CHECK(worst(1e-3, 1e3, root, cbrt) < 0.51);
}

TEST_CASE("elementary functions are exact where that is expected, and defined everywhere") {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  CHECK(exponential(0) == 1);
  CHECK(exponential(-infinity) == 0);
  CHECK(exponential(-1000) == 0);
  CHECK(exponential(1000) == infinity);
  CHECK(exponential(infinity) == infinity);
  CHECK(std::isnan(exponential(nan)));
  CHECK(logarithm(1) == 0);
  CHECK(logarithm(0) == -infinity);
  CHECK(logarithm(infinity) == infinity);
  CHECK(std::isnan(logarithm(-1)));
  CHECK(std::isnan(logarithm(nan)));
  CHECK(sine(0) == 0);
  CHECK(std::isnan(sine(infinity)));
  CHECK(cube_root(27) == 3);
  CHECK(cube_root(1) == 1);
}
