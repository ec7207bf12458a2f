// The cells that the ensemble can occupy: frame points outside are background. runtime/FORMAT.md sections 17 and 18.
#pragma once

#include "precompute/simulation.hpp"

#include <span>

namespace lbea::bake {
struct CellBlock;

/// Cubic cells over a box; cell x + nx (y + ny z) is bit (cell mod 64) of word (cell div 64).
struct EnvelopeGrid {
  std::array<float, 3> corner{};
  float edge = 1;
  std::array<std::uint32_t, 3> cells{};
  std::vector<std::uint64_t> bits;

  [[nodiscard]] std::size_t count() const noexcept { return std::size_t{cells[0]} * cells[1] * cells[2]; }
  /// False outside the grid.
  [[nodiscard]] bool contains(const std::array<float, 3>& point) const noexcept;
};

/// Collects the surfaces of all samples, then widens them by the margin. No point within the margin of a surface is
/// ever outside; points up to about three cell diagonals farther may be inside.
class EnvelopeBuilder {
 public:
  /// min, max: a box that contains every sample. Throws Error{bad_config} when it or the margin is not finite or
  /// the margin not positive.
  EnvelopeBuilder(const std::array<float, 3>& min, const std::array<float, 3>& max, double margin);
  /// positions: N x 3 of one sample. Safe from several threads; the result does not depend on them.
  void add(std::span<const float> positions, std::span<const Quad> elements);
  /// bits: of the layout() of another builder with the same box and margin. Safe from several threads.
  void add(std::span<const std::uint64_t> bits);
  /// Call once, after the last add().
  [[nodiscard]] EnvelopeGrid finish() const;
  /// The grid, with the cells marked so far.
  [[nodiscard]] const EnvelopeGrid& layout() const noexcept { return surface_; }

 private:
  using Corner = std::array<double, 3>;  // in cells
  /// Sets the grid's cells; returns their number, also when it is too large to be stored.
  double lay_out(const std::array<float, 3>& min, const std::array<float, 3>& max, double margin, double wanted_edge);
  void add_triangle(const Corner& a, const Corner& b, const Corner& c);
  void add_polygon(const std::vector<Corner>& polygon);
  void mark(const CellBlock& block, std::uint64_t cells);
  EnvelopeGrid surface_;
  double margin_cells_ = 0;
};
}  // namespace lbea::bake
