#include "runtime/src/numbers/elementary.hpp"

#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <numbers>

namespace lbea {
namespace {
using Limits = std::numeric_limits<double>;

/// A constant in two parts. The first has so few bits that its product with an integer of `spare_bits` bits is exact.
struct TwoParts {
  double high, low;
};
constexpr int spare_bits = 20;
constexpr TwoParts ln2{0x1.62e42fee00000p-1, 0x1.a39ef35793c76p-33};
constexpr TwoParts half_pi{0x1.921fb54400000p+0, 0x1.0b4611a626331p-34};
static_assert(ln2.high + ln2.low == std::numbers::ln2 && half_pi.high + half_pi.low == std::numbers::pi / 2);
static_assert(std::bit_cast<std::uint64_t>(ln2.high) % (1 << spare_bits) == 0);
static_assert(std::bit_cast<std::uint64_t>(half_pi.high) % (1 << spare_bits) == 0);

/// x less `times` of the constant.
double reduced(double x, double times, const TwoParts& constant) noexcept {
  return (x - times * constant.high) - times * constant.low;
}

/// c[0] + x c[1] + x^2 c[2] + ...
template <std::size_t N>
double polynomial(const std::array<double, N>& c, double x) noexcept {
  double sum = c[N - 1];
  for (std::size_t n = N - 1; n > 0; --n) sum = sum * x + c[n - 1];
  return sum;
}

/// sign^n / (first + n step)!
template <std::size_t N>
constexpr std::array<double, N> inverse_factorials(int first, int step, double sign) {
  std::array<double, N> c{};
  double factor = 1;
  for (std::size_t n = 0; n < N; ++n, factor *= sign) {
    double factorial = 1;  // up to 18!, exact
    for (int i = 2; i <= first + step * static_cast<int>(n); ++i) factorial *= i;
    c[n] = factor / factorial;
  }
  return c;
}

/// 2^n for -1022 <= n <= 1023.
double power_of_two(int n) noexcept { return std::bit_cast<double>(static_cast<std::uint64_t>(1023 + n) << 52); }
}  // namespace

// exp(x) = 2^k exp(r), |r| <= ln 2 / 2, by the series of exp(r).
double exponential(double x) noexcept {
  if (!(x > -746)) return x < 0 ? 0 : Limits::quiet_NaN();
  if (x > 710) return Limits::infinity();
  static constexpr auto series = inverse_factorials<12>(2, 1, 1);
  const double k = std::floor(x / std::numbers::ln2 + 0.5), r = reduced(x, k, ln2);
  const int half = static_cast<int>(k) / 2;  // 2^k itself may be no number of this type
  return (1 + (r + r * r * polynomial(series, r))) * power_of_two(half) * power_of_two(static_cast<int>(k) - half);
}

// log(2^k (1 + f)) = k ln 2 + 2 artanh(s), s = f / (2 + f), by the series of artanh(s); 2 s = f - s f.
double logarithm(double x) noexcept {
  if (!(x > 0)) return x == 0 ? -Limits::infinity() : Limits::quiet_NaN();
  if (x == Limits::infinity()) return x;
  static constexpr std::array<double, 12> series = [] {
    std::array<double, 12> c{};
    for (std::size_t n = 0; n < c.size(); ++n) c[n] = 2.0 / static_cast<double>(2 * n + 3);
    return c;
  }();
  int k = 0;
  double m = std::frexp(x, &k);
  if (m < 1 / std::numbers::sqrt2) m *= 2, --k;
  const double f = m - 1, s = f / (2 + f), squared = s * s;
  return k * ln2.high + (f - (s * (f - squared * polynomial(series, squared)) - k * ln2.low));
}

// sin(x) = +-sin(r) or +-cos(r), |r| <= pi / 4, by their series.
double sine(double radians) noexcept {
  static constexpr auto sines = inverse_factorials<8>(3, 2, -1);
  static constexpr auto cosines = inverse_factorials<8>(4, 2, -1);
  const double quarters = std::floor(radians / (std::numbers::pi / 2) + 0.5), r = reduced(radians, quarters, half_pi);
  const double squared = r * r, quadrant = quarters - 4 * std::floor(quarters / 4);
  const double first = 1 - squared / 2, rounding = (1 - first) - squared / 2;
  const bool is_odd = quadrant == 1 || quadrant == 3;
  const double value = is_odd ? first + (rounding + squared * squared * polynomial(cosines, squared))
                              : r - r * squared * polynomial(sines, squared);
  return quadrant < 2 ? value : -value;
}

float cube_root(float x) noexcept { return static_cast<float>(exponential(logarithm(double{x}) / 3)); }
}  // namespace lbea
