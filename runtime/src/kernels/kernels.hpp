// The inner loops, compiled once per instruction set and selected when the program starts. They use plain data only.
#pragma once

#include <cstddef>
#include <cstdint>

namespace lbea {
/// 16 points of a cloud, in reference coordinates. Lanes without a point are at infinity.
struct alignas(64) Leaf {
  float x[16], y[16], z[16];
  std::uint32_t point[16];  // place in the frame
};

/// 16 boxes of one level. Lanes without a box hold an inverted one, which is at infinite distance from everything.
struct alignas(64) BoxGroup {
  float low[3][16], high[3][16];
};

/// One point of the frame in reference coordinates, before it is sorted into its leaf.
struct PlacedPoint {
  float x, y, z;
  std::uint32_t point;
};
static_assert(sizeof(Leaf) == 16 * sizeof(PlacedPoint));

/// The data of a CellGrid that the loop needs.
struct GridView {
  float corner[3];
  float cells_per_length;
  std::uint32_t cells[3];
  std::uint32_t halvings;     // 1 when each cell is divided into octants, else 0
  const std::uint32_t* rank;  // one per cell, and one more for positions outside
};

inline constexpr std::size_t most_levels = 8;  // 16^8 leaves

/// The data of a search: leaves under a 16-ary tree of boxes. groups[0] holds the boxes of the leaves.
struct CloudTree {
  const Leaf* leaves;
  const BoxGroup* groups[most_levels];
  std::size_t top;  // the level that consists of one group
  // Some cells hold so many points that many boxes may be equally near; then searches also use `first`: per box, the
  // lowest place in the frame of a point in it.
  bool is_crowded;
  const std::uint32_t* first[most_levels];
};

/// A point of the cloud and its distance from a query.
struct NearestPoint {
  static constexpr std::uint32_t none = 0xffff'ffff;
  std::uint32_t point = none;        // its place in the frame
  float squared = __builtin_inff();  // distance
  float x = 0, y = 0, z = 0;         // reference coordinates
};

/// The nearest points of 16 queries. On entry to a search: no points, and the squared bounds.
struct alignas(64) NearestPoints {
  float squared[16];
  std::uint32_t point[16];  // NearestPoint::none: nothing within the bound
  std::uint32_t slot[16];   // leaf * 16 + lane in the leaf
  bool is_hard = false;     // the previous search, which was nearby, tested many points
  static constexpr std::uint32_t unlimited = 0xffff'ffff;
  std::uint32_t tests_left = unlimited;  // of leaves, in hard searches beyond ordinary ones
  bool is_cut = false;                   // hard, and no tests were left: its points are near, maybe not the nearest
};

/// A camera whose pixels are combined into cells. Depths are in steps from an origin.
struct CellRaster {
  float focal, center_column, center_row;  // in cells
  float depth_origin, steps_per_depth;
  std::uint32_t columns, rows;
};

/// Cells of a frame's depth image without a depth: the sensor saw nothing there; or the cell is occluded.
inline constexpr float nothing_seen = -1e9f, not_observed = -2e9f;

/// Greatest cost of a cell, and cost of a cell that only one of two images fills; in depth steps.
struct CellPrices {
  float cap, one_sided;
};

/// Sums over the points in a cell. Consecutive points are often in the same cell, so there are four independent sums:
/// no addition waits for the previous one.
struct alignas(32) CellTally {
  struct Sum {
    float depth, points;
  };
  Sum of[4];
};

struct CellSums {
  float squares;  // of the cells' costs
  float filled;   // cells that at least one image fills
};

/// Lines of a frame's depth image, in whole depth steps: enough to choose samples.
struct ImageLines {
  static constexpr std::size_t cells = 32, part = 8;  // of a line; lines between two checks of the limit
  const std::uint32_t* begins;                        // per line: its first cell
  std::size_t count;
  const std::uint16_t* observed;  // the frame's cells of these lines; 0: empty
  const std::uint16_t* counted;   // all bits: the sample's filled cells are counted here; none: not
  const float* filled_after;      // per part: cells behind it that the frame fills
};

/// Prices in units of 2^shift depth steps, such that sums of a part's squares fit into 32 bits.
struct ShortPrices {
  static constexpr std::uint16_t most = 11'000;
  std::uint16_t cap, one_sided;
  std::uint32_t shift;
};

struct LineSums : CellSums {  // squares: in those units
  float counted;              // filled by the sample, where they are counted
};

struct Kernels {
  const char* name;

  /// placed: the `count` points (3 floats each), transformed by the 3x4 matrix T and numbered; rank: that of each
  /// point's cell. Writes whole groups of 16; elements beyond `count` are meaningless.
  void (*place)(const float* points, std::size_t count, const float* T, const GridView& grid, PlacedPoint* placed,
                std::uint32_t* rank);
  /// begins: first element of each run of equal ranks, then `count`. Returns the number of runs. `rank` and `begins`
  /// have room for 16 more elements.
  std::size_t (*find_runs)(const std::uint32_t* rank, std::size_t count, std::uint32_t* begins);
  /// Converts the bytes of `count` PlacedPoints, sixteen in the memory of each leaf, to leaves, and sets their boxes.
  void (*fill_leaves)(std::size_t count, Leaf* leaves, BoxGroup* boxes);
  /// Sets the parents' boxes: each encloses 16 of the `count` boxes of the children.
  void (*enclose)(const BoxGroup* children, std::size_t count, BoxGroup* parents);
  /// The nearest point among those with squared distance <= bound.squared, `bound` when there is none; ties go to the
  /// point that comes first in the frame.
  NearestPoint (*nearest)(const CloudTree& tree, const float query[3], NearestPoint bound);
  /// The same for 16 queries near each other, as x, y, z planes. hints[i]: a slot whose leaf query i tests first, or
  /// none; a good hint makes the search faster, none changes its result unless it is cut.
  void (*nearest_16)(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints,
                     NearestPoints& best);
  /// Row by row: coefficients[j] = sum_i projection[j][i] * f[i]; `stride` floats per row, a multiple of 16.
  void (*project)(const float* projection, std::size_t rows, std::size_t stride, const float* f, float* coefficients);
  /// The same by numbers in 16 bits, each increased by 2^15.
  void (*project_short)(const std::uint16_t* projection, std::size_t rows, std::size_t stride, const float* f,
                        float* coefficients);
  /// Eq. 3: sum over modes of |e_j - s_j|, x, y and z planes of `stride` floats each. Returns a partial sum as soon as
  /// that is not below `bound`.
  float (*mode_distance)(const float* const e[3], const float* sample, std::size_t stride, float bound);
  /// sum += weight * values; `count` is a multiple of 16.
  void (*add_multiple)(float weight, const float* values, std::size_t count, float* sum);
  /// Sets weighted sums over the points of `count` leaves, relative to a place: of weights; x, y, z; xx, xy, xz, yy,
  /// yz, zz. The weight of a point at distance d is 1 - (d / reach)^2, or 0 beyond the reach and in lanes without a
  /// point.
  void (*sum_moments)(const Leaf* const* leaves, std::size_t count, const float place[3], float reach, float sums[10]);
  /// Adds depth and number of all points in `count` leaves to the tallies of their cells. T: camera coordinates from
  /// the leaves'. Points outside are added to cell columns * rows.
  void (*add_depths)(const Leaf* leaves, std::size_t count, const float T[12], const CellRaster& raster,
                     CellTally* tallies);
  /// Compares a frame's depth image (nothing_seen: empty; not_observed: ignored) with a sample's (0: empty). `cells` is
  /// a multiple of 16.
  CellSums (*compare_depths)(const float* observed, const std::uint16_t* sample, std::size_t cells,
                             const CellPrices& prices);
  /// The same of some lines. It is given up, with infinite squares, once the mean square of whole images must exceed
  /// `most`, even if all further cells of the frame cost nothing. Cells that only the sample fills must cost at least
  /// as much. next: the sample to prefetch.
  LineSums (*compare_lines)(const ImageLines& frame, const std::uint16_t* sample, const ShortPrices& prices, float most,
                            const std::uint16_t* next);
  /// The signed root of each cell's cost: sample minus frame.
  void (*subtract_depths)(const float* observed, const std::uint16_t* sample, std::size_t cells,
                          const CellPrices& prices, float* residual);
};

/// The fastest ones that this processor supports. All give the same bits.
[[nodiscard]] const Kernels& kernels() noexcept;

/// All that this processor supports, the fastest first, terminated by a null pointer: for tests and benchmarks.
[[nodiscard]] const Kernels* const* available_kernels() noexcept;
}  // namespace lbea

#ifdef LBEA_KERNELS
// Members of the table from kernel_search.cpp, in the namespace of the instruction set being compiled.
namespace lbea::LBEA_KERNELS {
NearestPoint nearest(const CloudTree& tree, const float query[3], NearestPoint bound);
void nearest_16(const CloudTree& tree, const float* const queries[3], const std::uint32_t* hints, NearestPoints& best);
void project(const float* projection, std::size_t rows, std::size_t stride, const float* f, float* coefficients);
void project_short(const std::uint16_t* projection, std::size_t rows, std::size_t stride, const float* f,
                   float* coefficients);
float mode_distance(const float* const e[3], const float* sample, std::size_t stride, float bound);
}  // namespace lbea::LBEA_KERNELS
#endif
