// The inner loops, compiled once per instruction set and chosen when the program starts: plain data in, plain data out.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lbea {

/// 16 points of a cloud, in reference coordinates. Places without a point are infinitely far.
struct alignas(64) Leaf {
  float x[16], y[16], z[16];
  std::uint32_t point[16];  // place in the frame
};

/// 16 boxes of one level. Places without a box are inverted: infinitely far from everything.
struct alignas(64) BoxGroup {
  float low[3][16], high[3][16];
};

/// One point on its way into its leaf.
struct PlacedPoint {
  float x, y, z;
  std::uint32_t point;
};
static_assert(sizeof(Leaf) == 16 * sizeof(PlacedPoint));

/// The cell grid as the loop needs it; see CellGrid.
struct GridView {
  float corner[3];
  float cells_per_length;
  std::uint32_t cells[3];
  std::uint32_t halvings;     // of a cell's edges: 0 or 1
  const std::uint32_t* rank;  // one more than there are cells: the last for positions outside
};

inline constexpr std::size_t most_levels = 8;  // 16^8 leaves

/// What a search reads: leaves under a 16-ary tree of boxes. groups[0] holds the leaves' boxes.
struct CloudTree {
  const Leaf* leaves;
  const BoxGroup* groups[most_levels];
  std::size_t top;  // the level that is one group
};

/// A point of the cloud as seen from a query position.
struct NearestPoint {
  static constexpr std::uint32_t none = 0xffff'ffff;
  std::uint32_t point = none;        // its place in the frame
  float squared = __builtin_inff();  // distance
  float x = 0, y = 0, z = 0;         // reference coordinates
};

/// The nearest points of 16 queries. On entry to a search no points, but bounds.
struct alignas(64) NearestPoints {
  float squared[16];
  std::uint32_t point[16];  // NearestPoint::none: nothing within the bound
  std::uint32_t slot[16];   // where the point lies: leaf * 16 + place in the leaf
};

/// A camera whose pixels are taken together in cells; depths are counted in steps from an origin.
struct CellRaster {
  float focal, centre_column, centre_row;  // in cells
  float depth_origin, steps_per_depth;
  std::uint32_t columns, rows;
};

/// Cells of a frame's depth image without a depth: the sensor looked and nothing was there; something hid what was
/// there.
inline constexpr float nothing_seen = -1e9f, not_observed = -2e9f;

/// What a cell costs at most, and what one costs that only one of two images fills; in depth steps.
struct CellPrices {
  float cap, one_sided;
};

/// What has fallen into a cell, four sums side by side: points that follow each other fall into the same cell, and four
/// sums do not wait for one another.
struct alignas(32) CellTally {
  float depth[4], points[4];
};

struct CellSums {
  float squares;  // of the cells' costs
  float filled;   // cells that at least one image fills
};

struct Kernels {
  const char* name;

  /// placed: the `count` points (3 floats each) times the 3x4 matrix T, numbered; rank: of each one's cell. Whole
  /// groups of 16 are written; those beyond `count` mean nothing.
  void (*place)(const float* points, std::size_t count, const float* T, const GridView& grid, PlacedPoint* placed,
                std::uint32_t* rank);
  /// Where runs of equal ranks begin, and at last `count`; returns how many runs. `rank` and `begins` have room for 16
  /// more.
  std::size_t (*find_runs)(const std::uint32_t* rank, std::size_t count, std::uint32_t* begins);
  /// Turns the bytes of `count` PlacedPoints, sixteen in the place of each leaf, into leaves and encloses each.
  void (*fill_leaves)(std::size_t count, Leaf* leaves, BoxGroup* boxes);
  /// Encloses `count` boxes, 16 by 16.
  void (*enclose)(const BoxGroup* children, std::size_t count, BoxGroup* parents);
  /// The nearest point among those with squared distance <= bound.squared, `bound` when there is none; ties go to the
  /// lower place in the frame.
  NearestPoint (*nearest)(const CloudTree& tree, const float query[3], NearestPoint bound);
  /// The same for 16 queries that lie near each other: x, y, z of each. hints[i]: a slot whose leaf query i looks at
  /// first, or none; a good one bounds the search, no one changes its answer.
  void (*nearest_16)(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints,
                     NearestPoints& best);
  /// Row by row: coefficients[j] = sum_i projection[j][i] * f[i]; `stride` floats per row, a multiple of 16.
  void (*project)(const float* projection, std::size_t rows, std::size_t stride, const float* f, float* coefficients);
  /// Eq. 3: sum over modes of |e_j - s_j|, x, y and z planes of `stride` floats each. Stops early, with what it has, as
  /// soon as that is not below `bound`.
  float (*mode_distance)(const float* const e[3], const float* sample, std::size_t stride, float bound);
  /// Adds every point of the leaves, seen from a camera at T (camera coordinates from the leaves'), to its cell: depth
  /// and number. What lies outside is added to cell columns * rows.
  void (*add_depths)(const Leaf* leaves, std::size_t count, const float T[12], const CellRaster& raster,
                     CellTally* tallies);
  /// A frame's depth image (nothing_seen: empty; not_observed: counts for nothing) against a sample's (0: empty);
  /// `cells` is a multiple of 16.
  CellSums (*compare_views)(const float* observed, const std::uint16_t* sample, std::size_t cells,
                            const CellPrices& prices);
  /// The same cell by cell, with its sign: sample less frame.
  void (*subtract_views)(const float* observed, const std::uint16_t* sample, std::size_t cells,
                         const CellPrices& prices, float* residual);
};

/// The best that this processor runs; every one gives the same bits.
[[nodiscard]] const Kernels& kernels() noexcept;

/// All that this processor runs, the best first, ended by a null pointer: for tests and benchmarks.
[[nodiscard]] const Kernels* const* available_kernels() noexcept;

}  // namespace lbea
