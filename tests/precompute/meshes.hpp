// Surfaces whose Laplace-Beltrami spectrum is known.
#pragma once

#include "precompute/basis/mesh_laplacian.hpp"

#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <utility>
#include <vector>

namespace lbea::test {

using namespace lbea::bake;

struct Surface {
  std::vector<float> positions;  // n x 3
  std::vector<Quad> elements;

  [[nodiscard]] std::size_t vertices() const { return positions.size() / 3; }
  std::uint32_t add(double x, double y, double z) {
    positions.insert(positions.end(), {static_cast<float>(x), static_cast<float>(y), static_cast<float>(z)});
    return static_cast<std::uint32_t>(vertices() - 1);
  }
};

/// cells x cells quads over width x height; inner vertices moved at random by up to `jitter` of a cell, in the plane.
inline Surface rectangle(std::uint32_t cells, double width, double height, double jitter = 0, std::uint32_t seed = 1) {
  Surface surface;
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> shift(-jitter, jitter);
  for (std::uint32_t j = 0; j <= cells; ++j)
    for (std::uint32_t i = 0; i <= cells; ++i) {
      const bool inner = i > 0 && j > 0 && i < cells && j < cells;
      const double di = inner ? shift(random) : 0, dj = inner ? shift(random) : 0;
      surface.add(width * (i + di) / cells, height * (j + dj) / cells, 0);
    }
  for (std::uint32_t j = 0; j < cells; ++j)
    for (std::uint32_t i = 0; i < cells; ++i) {
      const std::uint32_t v = j * (cells + 1) + i;
      surface.elements.push_back({v, v + 1, v + cells + 2, v + cells + 1});
    }
  return surface;
}

/// The side of a cylinder: `around` x `along` quads, both ends open.
inline Surface open_cylinder(std::uint32_t around, std::uint32_t along, double radius, double height) {
  Surface surface;
  for (std::uint32_t j = 0; j <= along; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const double angle = 2 * std::numbers::pi * i / around;
      surface.add(radius * std::cos(angle), radius * std::sin(angle), height * j / along);
    }
  for (std::uint32_t j = 0; j < along; ++j)
    for (std::uint32_t i = 0; i < around; ++i) {
      const std::uint32_t v = j * around + i, w = j * around + (i + 1) % around;
      surface.elements.push_back({v, w, w + around, v + around});
    }
  return surface;
}

/// The unit sphere: an octahedron whose triangles are quartered `levels` times; a triangle repeats its last node.
inline Surface sphere(int levels) {
  Surface surface;
  for (const double sign : {1.0, -1.0}) {
    surface.add(sign, 0, 0);
    surface.add(0, sign, 0);
    surface.add(0, 0, sign);
  }
  std::vector<std::array<std::uint32_t, 3>> triangles{{0, 1, 2}, {1, 3, 2}, {3, 4, 2}, {4, 0, 2},
                                                      {1, 0, 5}, {3, 1, 5}, {4, 3, 5}, {0, 4, 5}};
  for (int level = 0; level < levels; ++level) {
    std::map<std::pair<std::uint32_t, std::uint32_t>, std::uint32_t> midpoints;
    const auto midpoint = [&](std::uint32_t a, std::uint32_t b) {
      const auto key = std::minmax(a, b);
      if (const auto found = midpoints.find(key); found != midpoints.end()) return found->second;
      const auto sum = [&](std::size_t axis) {
        return static_cast<double>(surface.positions[3 * a + axis]) +
               static_cast<double>(surface.positions[3 * b + axis]);
      };
      const double x = sum(0), y = sum(1), z = sum(2), length = std::hypot(x, y, z);
      return midpoints[key] = surface.add(x / length, y / length, z / length);
    };
    std::vector<std::array<std::uint32_t, 3>> finer;
    for (const auto& [a, b, c] : triangles) {
      const std::uint32_t ab = midpoint(a, b), bc = midpoint(b, c), ca = midpoint(c, a);
      finer.insert(finer.end(), {{a, ab, ca}, {ab, b, bc}, {ca, bc, c}, {ab, bc, ca}});
    }
    triangles = std::move(finer);
  }
  for (const auto& [a, b, c] : triangles) surface.elements.push_back({a, b, c, c});
  return surface;
}

/// `other` beside `surface`, without a common vertex.
inline void append(Surface& surface, const Surface& other, double shift_x) {
  const auto first = static_cast<std::uint32_t>(surface.vertices());
  for (std::size_t i = 0; i < other.vertices(); ++i) {
    const auto at = [&](std::size_t axis) { return static_cast<double>(other.positions[3 * i + axis]); };
    surface.add(at(0) + shift_x, at(1), at(2));
  }
  for (const Quad& q : other.elements)
    surface.elements.push_back({q[0] + first, q[1] + first, q[2] + first, q[3] + first});
}

inline MeshLaplacian laplacian_of(const Surface& surface) {
  return mesh_laplacian(surface.positions, surface.elements);
}

}  // namespace lbea::test
