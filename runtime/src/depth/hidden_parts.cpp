#include "runtime/src/depth/hidden_parts.hpp"

#include <algorithm>
#include <numeric>

namespace lbea {
namespace {

/// Combines five values at intervals of `step`, the first, or with a negative step the last, at the result's place.
template <class Combine>
void combine_five(const std::vector<std::uint8_t>& of, std::ptrdiff_t step, std::vector<std::uint8_t>& pairs,
                  std::vector<std::uint8_t>& into, const Combine& combine) noexcept {
  const std::ptrdiff_t count = std::ssize(of), before = std::max<std::ptrdiff_t>(-step, 0),
                       after = std::max<std::ptrdiff_t>(step, 0);
  const std::uint8_t* value = of.data();
  std::uint8_t *pair = pairs.data(), *result = into.data();
  for (std::ptrdiff_t i = before; i < count - after; ++i) pair[i] = combine(value[i], value[i + step]);
  for (std::ptrdiff_t i = 4 * before; i < count - 4 * after; ++i)
    result[i] = combine(combine(pair[i], pair[i + 2 * step]), value[i + 4 * step]);
}

}  // namespace

HiddenParts::HiddenParts(const DepthCamera& camera)
    : columns_(camera.columns),
      rows_(camera.rows),
      stride_(camera.columns + margin),
      empty_((camera.rows + 2 * margin) * stride_ + margin),
      differing_(empty_.size()),
      pairs_(empty_.size()),
      along_row_(empty_.size()),
      parts_(empty_.size()) {}

void HiddenParts::set_frame(std::span<const float> observed) noexcept {
  for (std::size_t row = 0; row < rows_; ++row)
    for (std::size_t column = 0; column < columns_; ++column)
      empty_[at(row, column)] = observed[row * columns_ + column] < 0 ? 1 : 0;
}

/// Opening by squares: what squares of `width` cells inside the differing cells cover.
std::size_t HiddenParts::find(std::span<const std::uint16_t> image) noexcept {
  const std::size_t columns = columns_;  // bytes alias members: the loops below would read them again for each
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::uint16_t* filled = &image[row * columns];
    const std::uint8_t* empty = &empty_[at(row, 0)];
    std::uint8_t* differing = &differing_[at(row, 0)];
    for (std::size_t column = 0; column < columns; ++column)
      differing[column] = static_cast<std::uint8_t>((filled[column] != empty_cell) & empty[column]);
  }
  const auto both = [](std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a & b); };
  const auto either = [](std::uint8_t a, std::uint8_t b) { return static_cast<std::uint8_t>(a | b); };
  const auto down = static_cast<std::ptrdiff_t>(stride_);
  combine_five(differing_, 1, pairs_, along_row_, both);
  combine_five(along_row_, down, pairs_, parts_, both);
  combine_five(parts_, -1, pairs_, along_row_, either);
  combine_five(along_row_, -down, pairs_, parts_, either);
  std::size_t count = 0;
  for (std::size_t row = 0; row < rows_; ++row) {
    const std::uint8_t* part = &parts_[at(row, 0)];
    std::uint16_t in_row = 0;  // half as many lanes as bytes, not an eighth
    for (std::size_t column = 0; column < columns; ++column) in_row = static_cast<std::uint16_t>(in_row + part[column]);
    count += in_row;
  }
  return count;
}

}  // namespace lbea
