#include "precompute/envelope.hpp"

#include <lbea/lbea.hpp>

#include <algorithm>
#include <atomic>
#include <cmath>

namespace lbea {

namespace {

constexpr double most_cells = 1 << 17;   // about; 16 KiB stay in the cache of whoever culls points
constexpr double margin_per_edge = 4;    // cells need not be finer than this
constexpr double rounding_slack = 0.01;  // cells; floats of the runtime may round a point into the next cell

std::size_t words(std::size_t bits) { return (bits + 63) / 64; }

std::size_t index_of(const EnvelopeGrid& grid, std::size_t x, std::size_t y, std::size_t z) {
  return x + grid.cells[0] * (y + std::size_t{grid.cells[1]} * z);
}

bool test(const EnvelopeGrid& grid, std::size_t cell) {
  return (grid.bits[cell / 64] >> (cell % 64) & 1) != 0;
}

/// Offsets of the cells that come within `margin` (in cells) of a cell.
std::vector<std::array<std::int64_t, 3>> ball(double margin) {
  const auto reach = static_cast<std::int64_t>(std::ceil(margin)) + 1;
  const auto gap = [](std::int64_t offset) {
    return static_cast<double>(std::max<std::int64_t>(std::abs(offset) - 1, 0));
  };
  std::vector<std::array<std::int64_t, 3>> offsets;
  for (std::int64_t z = -reach; z <= reach; ++z)
    for (std::int64_t y = -reach; y <= reach; ++y)
      for (std::int64_t x = -reach; x <= reach; ++x)
        if (std::hypot(gap(x), gap(y), gap(z)) <= margin) offsets.push_back({x, y, z});
  return offsets;
}

}  // namespace

bool EnvelopeGrid::contains(const std::array<float, 3>& point) const noexcept {
  std::array<std::size_t, 3> at{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double cell = std::floor((double{point[axis]} - double{corner[axis]}) / double{edge});
    if (!(cell >= 0 && cell < cells[axis])) return false;
    at[axis] = static_cast<std::size_t>(cell);
  }
  return test(*this, index_of(*this, at[0], at[1], at[2]));
}

EnvelopeBuilder::EnvelopeBuilder(const std::array<float, 3>& min, const std::array<float, 3>& max,
                                 double margin) {
  double volume = 1;
  for (std::size_t axis = 0; axis < 3; ++axis) volume *= double{max[axis]} - double{min[axis]} + 2 * margin;
  if (!(margin > 0 && volume > 0 && std::isfinite(volume)))
    throw Error(Status::bad_config,
                "the envelope margin must be positive and the positions finite; the margin is " +
                    std::to_string(margin));
  surface_.edge = static_cast<float>(std::max(margin / margin_per_edge, std::cbrt(volume / most_cells)));
  const double edge = double{surface_.edge};
  margin_cells_ = margin / edge + rounding_slack;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double room = (margin_cells_ + rounding_slack) * edge;
    surface_.corner[axis] = static_cast<float>(double{min[axis]} - room);
    const double cells = std::ceil((double{max[axis]} + room - double{surface_.corner[axis]}) / edge);
    surface_.cells[axis] = static_cast<std::uint32_t>(std::max(cells, 1.0));
  }
  surface_.bits.assign(words(surface_.count()), 0);
}

void EnvelopeBuilder::add(std::span<const float> positions, std::span<const Quad> elements) {
  const auto in_cells = [&](std::uint32_t node) {
    Corner corner{};
    for (std::size_t axis = 0; axis < 3; ++axis)
      corner[axis] = (double{positions[3 * std::size_t{node} + axis]} - double{surface_.corner[axis]}) /
                     double{surface_.edge};
    return corner;
  };
  for (const Quad& q : elements) {
    const std::array<Corner, 4> corners{in_cells(q[0]), in_cells(q[1]), in_cells(q[2]), in_cells(q[3])};
    add_triangle(corners[0], corners[1], corners[2]);
    if (q[2] != q[3]) add_triangle(corners[0], corners[2], corners[3]);
  }
}

void EnvelopeBuilder::add(std::span<const std::uint64_t> bits) {
  for (std::size_t i = 0; i < std::min(bits.size(), surface_.bits.size()); ++i)
    std::atomic_ref<std::uint64_t>(surface_.bits[i]).fetch_or(bits[i], std::memory_order_relaxed);
}

// Marks all cells of the bounding box once that is not larger than a cell, halving the edges until then.
void EnvelopeBuilder::add_triangle(const Corner& a, const Corner& b, const Corner& c) {
  Corner min{}, max{}, ab{}, bc{}, ca{};
  double largest = 0;
  for (std::size_t axis = 0; axis < 3; ++axis) {
    min[axis] = std::min({a[axis], b[axis], c[axis]});
    max[axis] = std::max({a[axis], b[axis], c[axis]});
    largest = std::max(largest, max[axis] - min[axis]);
    ab[axis] = (a[axis] + b[axis]) / 2;
    bc[axis] = (b[axis] + c[axis]) / 2;
    ca[axis] = (c[axis] + a[axis]) / 2;
  }
  if (largest <= 1) return mark(min, max);
  add_triangle(a, ab, ca);
  add_triangle(ab, b, bc);
  add_triangle(ca, bc, c);
  add_triangle(ab, bc, ca);
}

void EnvelopeBuilder::mark(const Corner& min, const Corner& max) {
  std::array<std::size_t, 3> first{}, last{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double end = static_cast<double>(surface_.cells[axis]) - 1;
    const auto cell = [end](double along) { return static_cast<std::size_t>(static_cast<std::int64_t>(std::clamp(along, 0.0, end))); };
    first[axis] = cell(min[axis]);
    last[axis] = cell(max[axis]);
  }
  for (std::size_t z = first[2]; z <= last[2]; ++z)
    for (std::size_t y = first[1]; y <= last[1]; ++y)
      for (std::size_t x = first[0]; x <= last[0]; ++x) {
        const std::size_t cell = index_of(surface_, x, y, z);
        const std::uint64_t bit = std::uint64_t{1} << (cell % 64);
        std::atomic_ref<std::uint64_t> word(surface_.bits[cell / 64]);
        if ((word.load(std::memory_order_relaxed) & bit) == 0) word.fetch_or(bit, std::memory_order_relaxed);
      }
}

EnvelopeGrid EnvelopeBuilder::finish() const {
  EnvelopeGrid wide = surface_;
  const auto offsets = ball(margin_cells_);
  const std::array<std::int64_t, 3> cells{surface_.cells[0], surface_.cells[1], surface_.cells[2]};
  for (std::int64_t z = 0; z < cells[2]; ++z)
    for (std::int64_t y = 0; y < cells[1]; ++y)
      for (std::int64_t x = 0; x < cells[0]; ++x) {
        const auto at = [&](std::int64_t i, std::int64_t j, std::int64_t k) {
          return index_of(surface_, static_cast<std::size_t>(i), static_cast<std::size_t>(j),
                          static_cast<std::size_t>(k));
        };
        if (!test(surface_, at(x, y, z))) continue;
        for (const auto& [dx, dy, dz] : offsets) {
          const std::int64_t i = x + dx, j = y + dy, k = z + dz;
          if (i < 0 || j < 0 || k < 0 || i >= cells[0] || j >= cells[1] || k >= cells[2]) continue;
          const std::size_t cell = at(i, j, k);
          wide.bits[cell / 64] |= std::uint64_t{1} << (cell % 64);
        }
      }
  return wide;
}

}  // namespace lbea
