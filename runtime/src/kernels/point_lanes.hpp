// Conversion of sixteen points between layouts: packed x y z, planes of one coordinate, x y z and number per point,
// leaves. Only kernel_code.cpp includes this.
#pragma once

#include "runtime/src/kernels/kernels.hpp"
#include "runtime/src/kernels/lanes.hpp"

namespace lbea::LBEA_KERNELS {
namespace {

constexpr float infinity = __builtin_inff();

struct Block {
  Floats x, y, z;
};

struct Corners {
  float low[3], high[3];
};
constexpr Corners inverted{{infinity, infinity, infinity}, {-infinity, -infinity, -infinity}};

#if defined(__AVX512F__)

// Separates three vectors of packed x y z by coordinate. Lanes 0-15 are the first vector, 16-31 the second.
Block apart(const Floats& a, const Floats& b, const Floats& c) {
  const Floats x = pick<0, 3, 6, 9, 12, 15, 18, 21, 24, 27, 30, 0, 0, 0, 0, 0>(a, b);
  const Floats y = pick<1, 4, 7, 10, 13, 16, 19, 22, 25, 28, 31, 0, 0, 0, 0, 0>(a, b);
  const Floats z = pick<2, 5, 8, 11, 14, 17, 20, 23, 26, 29, 0, 0, 0, 0, 0, 0>(a, b);
  return {pick<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 17, 20, 23, 26, 29>(x, c),
          pick<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 18, 21, 24, 27, 30>(y, c),
          pick<0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 16, 19, 22, 25, 28, 31>(z, c)};
}

Block load_points(const float* points) { return apart(load(points), load(points + lanes), load(points + 2 * lanes)); }

// Stores x y z and number of sixteen points, point by point.
void store_placed(const Block& position, const Ints& number, PlacedPoint* to) {
  const auto& [x, y, z] = position;
  Floats p;
  __builtin_memcpy(&p, &number, sizeof(p));
  const auto lower_pairs = [](const Floats& a, const Floats& b) {
    return pick<0, 16, 1, 17, 2, 18, 3, 19, 4, 20, 5, 21, 6, 22, 7, 23>(a, b);
  };
  const auto upper_pairs = [](const Floats& a, const Floats& b) {
    return pick<8, 24, 9, 25, 10, 26, 11, 27, 12, 28, 13, 29, 14, 30, 15, 31>(a, b);
  };
  const auto lower_fours = [](const Floats& a, const Floats& b) {
    return pick<0, 1, 16, 17, 2, 3, 18, 19, 4, 5, 20, 21, 6, 7, 22, 23>(a, b);
  };
  const auto upper_fours = [](const Floats& a, const Floats& b) {
    return pick<8, 9, 24, 25, 10, 11, 26, 27, 12, 13, 28, 29, 14, 15, 30, 31>(a, b);
  };
  const Floats xy[2] = {lower_pairs(x, y), upper_pairs(x, y)}, zp[2] = {lower_pairs(z, p), upper_pairs(z, p)};
  for (std::size_t half = 0; half < 2; ++half) {
    store(&to[8 * half].x, lower_fours(xy[half], zp[half]));
    store(&to[8 * half + 4].x, upper_fours(xy[half], zp[half]));
  }
}

Floats halves_swapped(const Floats& v) { return pick<8, 9, 10, 11, 12, 13, 14, 15, 0, 1, 2, 3, 4, 5, 6, 7>(v, v); }
Floats quarters_swapped(const Floats& v) { return pick<4, 5, 6, 7, 0, 1, 2, 3, 12, 13, 14, 15, 8, 9, 10, 11>(v, v); }

// The box of vectors of four points, x y z and number each: lanes 0, 1, 2 after folding.
Corners corners(Floats low, Floats high) {
  low = minimum(low, halves_swapped(low));
  low = minimum(low, quarters_swapped(low));
  high = maximum(high, halves_swapped(high));
  high = maximum(high, quarters_swapped(high));
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

// Of eight points x y z p: eight x and eight y, or eight z and eight p.
Floats pick_xy(const Floats& a, const Floats& b) {
  return pick<0, 4, 8, 12, 16, 20, 24, 28, 1, 5, 9, 13, 17, 21, 25, 29>(a, b);
}
Floats pick_zp(const Floats& a, const Floats& b) {
  return pick<2, 6, 10, 14, 18, 22, 26, 30, 3, 7, 11, 15, 19, 23, 27, 31>(a, b);
}
Floats first_halves(const Floats& a, const Floats& b) {
  return pick<0, 1, 2, 3, 4, 5, 6, 7, 16, 17, 18, 19, 20, 21, 22, 23>(a, b);
}
Floats second_halves(const Floats& a, const Floats& b) {
  return pick<8, 9, 10, 11, 12, 13, 14, 15, 24, 25, 26, 27, 28, 29, 30, 31>(a, b);
}

// Converts the bytes of sixteen placed points to a leaf and returns its box.
Corners fill_whole_leaf(Leaf& leaf) {
  const float* from = leaf.x;
  const Floats a = load(from), b = load(from + lanes), c = load(from + 2 * lanes), d = load(from + 3 * lanes);
  // Pairs of coordinates of the first and the last eight points, then one coordinate of all sixteen.
  const Floats xy_low = pick_xy(a, b), xy_high = pick_xy(c, d), zp_low = pick_zp(a, b), zp_high = pick_zp(c, d);
  store(leaf.x, first_halves(xy_low, xy_high));
  store(leaf.y, second_halves(xy_low, xy_high));
  store(leaf.z, first_halves(zp_low, zp_high));
  store(leaf.point, second_halves(zp_low, zp_high));
  return corners(minimum(minimum(a, b), minimum(c, d)), maximum(maximum(a, b), maximum(c, d)));
}

#else

// x y z x | y z x y | z x y z: four points.
Fours apart(Four a, Four b, Four c) {
  const Four x = __builtin_shufflevector(a, b, 0, 3, 6, 6), y = __builtin_shufflevector(a, b, 1, 4, 7, 7),
             z = __builtin_shufflevector(a, b, 2, 5, 5, 5);
  return {{__builtin_shufflevector(x, c, 0, 1, 2, 5), __builtin_shufflevector(y, c, 0, 1, 2, 6),
           __builtin_shufflevector(z, c, 0, 1, 4, 7), Four{}}};
}

Block load_points(const float* points) {
  Fours x, y, z;
  for (std::size_t i = 0; i < 4; ++i) {
    const float* from = points + 12 * i;
    const Fours xyz = apart(load_four(from), load_four(from + 4), load_four(from + 8));
    x.at[i] = xyz.at[0], y.at[i] = xyz.at[1], z.at[i] = xyz.at[2];
  }
  return {joined(x), joined(y), joined(z)};
}

// Stores x y z and number of sixteen points, point by point.
void store_placed(const Block& position, const Ints& number, PlacedPoint* to) {
  Floats p;
  __builtin_memcpy(&p, &number, sizeof(p));
  const Fours x = divided(position.x), y = divided(position.y), z = divided(position.z), numbers = divided(p);
  for (std::size_t i = 0; i < 4; ++i) {
    const Fours points = transposed({{x.at[i], y.at[i], z.at[i], numbers.at[i]}});
    for (std::size_t k = 0; k < 4; ++k) store_four(&to[4 * i + k].x, points.at[k]);
  }
}

// Converts the bytes of sixteen placed points to a leaf and returns its box: lanes 0, 1, 2 after folding.
Corners fill_whole_leaf(Leaf& leaf) {
  Fours coordinates[4];
  Four low = load_four(leaf.x), high = low;
  for (std::size_t i = 0; i < 4; ++i) {
    Fours of_points;
    for (std::size_t k = 0; k < 4; ++k) {
      const Four point = of_points.at[k] = load_four(leaf.x + 16 * i + 4 * k);
      low = point < low ? point : low;
      high = point > high ? point : high;
    }
    coordinates[i] = transposed(of_points);
  }
  for (std::size_t i = 0; i < 4; ++i) {
    store_four(leaf.x + 4 * i, coordinates[i].at[0]);
    store_four(leaf.y + 4 * i, coordinates[i].at[1]);
    store_four(leaf.z + 4 * i, coordinates[i].at[2]);
    __builtin_memcpy(leaf.point + 4 * i, &coordinates[i].at[3], sizeof(Four));
  }
  return {{low[0], low[1], low[2]}, {high[0], high[1], high[2]}};
}

#endif

}  // namespace
}  // namespace lbea::LBEA_KERNELS
