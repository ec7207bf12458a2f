// Elementary functions with the same bits everywhere: the libraries of C systems differ in the last bits of theirs,
// some even from processor to processor. They err by about one unit in the last place.
#pragma once

namespace lbea {
[[nodiscard]] double exponential(double x) noexcept;
[[nodiscard]] double logarithm(double x) noexcept;   // natural; -infinity of 0, NaN of negative numbers
[[nodiscard]] double sine(double radians) noexcept;  // of up to 10^5 radians
[[nodiscard]] float cube_root(float x) noexcept;     // of positive numbers
}  // namespace lbea
