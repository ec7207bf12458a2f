// n positions as x, y and z planes, padded with zeros to whole 64-byte lines.
#pragma once

#include "runtime/src/model/model_format.hpp"

#include <array>
#include <cstddef>
#include <vector>

namespace lbea {

struct Positions {
  explicit Positions(std::size_t n) : count(n), planes{plane(n), plane(n), plane(n)} {}

  [[nodiscard]] std::array<float, 3> operator[](std::size_t i) const noexcept {
    return {planes[0][i], planes[1][i], planes[2][i]};
  }
  void set(std::size_t i, const std::array<float, 3>& position) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis) planes[axis][i] = position[axis];
  }

  std::size_t count;
  std::array<std::vector<float>, 3> planes;

 private:
  static std::vector<float> plane(std::size_t n) { return std::vector<float>(format::padded(n)); }
};

}  // namespace lbea
