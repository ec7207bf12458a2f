#include "runtime/src/depth/image_comparison.hpp"

namespace lbea {

CellPrices prices_of(const DepthMetric& metric, const DepthCamera& camera) noexcept {
  return {metric.cap / camera.depth_step, metric.one_sided / camera.depth_step};
}

float mean_square(const Kernels& code, std::span<const float> observed, const std::uint16_t* sample,
                  const CellPrices& prices) noexcept {
  const CellSums sums = code.compare_depths(observed.data(), sample, observed.size(), prices);
  return sums.squares / std::max(sums.filled, 1.0f);
}

namespace {

/// Calls visit(cell) for one and the cells around it.
template <class Visit>
void visit_around(const DepthCamera& camera, std::size_t cell, const Visit& visit) noexcept {
  const std::size_t row = cell / camera.columns, column = cell % camera.columns;
  const auto begin = [](std::size_t i) { return i - std::min<std::size_t>(i, 1); };
  for (std::size_t r = begin(row); r < std::min<std::size_t>(row + 2, camera.rows); ++r)
    for (std::size_t c = begin(column); c < std::min<std::size_t>(column + 2, camera.columns); ++c)
      visit(r * camera.columns + c);
}

/// Of what either image shows in a cell, the least difference to the 3 x 3 cells of the other one: the greater of the
/// two. Infinite if the other image shows nothing there.
float tolerant_difference(const DepthCamera& camera, std::span<const float> observed,
                          std::span<const std::uint16_t> image, std::size_t cell) noexcept {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  const float seen = observed[cell], expected = image[cell];
  const bool is_seen = seen >= 0, is_expected = image[cell] != empty_cell;
  float of_seen = is_seen ? infinity : 0, of_expected = is_expected ? infinity : 0;
  visit_around(camera, cell, [&](std::size_t other) {
    if (is_seen && image[other] != empty_cell)
      of_seen = std::min(of_seen, std::abs(static_cast<float>(image[other]) - seen));
    if (is_expected && observed[other] >= 0) of_expected = std::min(of_expected, std::abs(observed[other] - expected));
  });
  return std::max(of_seen, of_expected);
}

}  // namespace

float tolerant_residuals(const Kernels& code, const DepthCamera& camera, const CellPrices& prices,
                         std::span<const float> observed, std::span<const std::uint16_t> image,
                         std::span<float> residuals) noexcept {
  code.subtract_depths(observed.data(), image.data(), observed.size(), prices, residuals.data());
  const float origin = camera.depth_origin / camera.depth_step;
  const auto is_edge = [&](std::size_t cell) {
    const float width = (origin + std::max(observed[cell], static_cast<float>(image[cell]))) / camera.focal;
    return std::abs(residuals[cell]) > width;
  };
  constexpr std::size_t line = 32;
  for (std::size_t begin = 0; begin < camera.cells(); begin += line) {
    const std::size_t end = std::min(begin + line, camera.cells());
    int edges = 0;  // most lines have none, and their cells are tested several at once
    for (std::size_t cell = begin; cell < end; ++cell) edges += is_edge(cell) ? 1 : 0;
    for (std::size_t cell = begin; edges > 0 && cell < end; ++cell)
      if (is_edge(cell))
        residuals[cell] = std::copysign(
            std::min(tolerant_difference(camera, observed, image, cell), std::abs(residuals[cell])), residuals[cell]);
  }
  float squares = 0;
  code.project(residuals.data(), 1, residuals.size(), residuals.data(), &squares);
  return squares / std::max(code.compare_depths(observed.data(), image.data(), observed.size(), prices).filled, 1.0f);
}

float share_after_interpolation(const Kernels& code, std::span<const float> a, std::span<const float> b) noexcept {
  const auto product = [&](std::span<const float> x, std::span<const float> y) {
    float sum = 0;
    code.project(x.data(), 1, x.size(), y.data(), &sum);
    return sum;
  };
  const float squared = product(a, a), decrease = squared - product(a, b);
  const float apart = 2 * decrease - squared + product(b, b);  // |a - b|^2
  if (!(squared > 0) || !(apart > 0)) return 1;
  const float t = std::clamp(decrease / apart, 0.0f, 1.0f);
  return std::max(squared - t * (2 * decrease - t * apart), 0.0f) / squared;
}

namespace {

std::uint16_t bits_if(bool all) noexcept { return static_cast<std::uint16_t>(all ? 0xFFFF : 0); }

}  // namespace

[[gnu::cold]]  // compiled for size
LineComparison::LineComparison(std::size_t cells, const CellPrices& prices)
    : begins_((cells + ImageLines::cells - 1) / ImageLines::cells),
      observed_(begins_.size() * ImageLines::cells),
      counted_(observed_.size()),
      filled_after_(begins_.size()) {
  const float largest = std::max(prices.cap, prices.one_sided);
  while (prices_.shift < 15 && largest > std::ldexp(float{ShortPrices::most}, static_cast<int>(prices_.shift)))
    ++prices_.shift;
  const float scale = std::ldexp(1.0f, static_cast<int>(prices_.shift));
  const auto in_units = [scale](float price) {
    return static_cast<std::uint16_t>(std::lround(std::min(price / scale, float{ShortPrices::most})));
  };
  prices_.cap = in_units(prices.cap);
  prices_.one_sided = in_units(prices.one_sided);
  unit_ = square(scale);
  one_sided_ = square(prices.one_sided);
}

void LineComparison::set_frame(std::span<const float> observed) noexcept {
  constexpr std::size_t cells = ImageLines::cells;
  count_ = 0;
  for (std::size_t begin = 0; begin < observed.size(); begin += cells) {
    const auto line = observed.subspan(begin, cells);
    std::ranges::transform(line, &counted_[begin], [](float depth) { return bits_if(!(depth > not_observed)); });
    add_line(begin, set_line(line));
  }
  finish();
}

void LineComparison::set_filled_lines(std::span<const float> observed) noexcept {
  constexpr std::size_t cells = ImageLines::cells;
  count_ = 0;
  for (std::size_t begin = 0; begin < observed.size(); begin += cells)
    if (const int filled = set_line(observed.subspan(begin, cells)); filled > 0) {
      std::fill_n(&counted_[count_ * cells], cells, bits_if(true));
      add_line(begin, filled);
    }
  finish();
}

[[gnu::noinline]]  // one copy for both kinds of lines
int LineComparison::set_line(std::span<const float> observed) noexcept {
  constexpr float most = std::numeric_limits<std::uint16_t>::max();
  std::uint16_t* const line = &observed_[count_ * ImageLines::cells];
  int filled = 0;
  for (std::size_t c = 0; c < ImageLines::cells; ++c) {
    const float depth = observed[c];
    line[c] = static_cast<std::uint16_t>(static_cast<int>(depth >= 0 ? std::clamp(depth + 0.5f, 1.0f, most) : 0.0f));
    filled += depth >= 0 ? 1 : 0;
  }
  return filled;
}

void LineComparison::add_line(std::size_t begin, int filled) noexcept {
  filled_after_[count_] = static_cast<float>(filled);
  begins_[count_++] = static_cast<std::uint32_t>(begin);
}

void LineComparison::finish() noexcept {
  float all = 0;
  for (std::size_t line = 0; line < count_; ++line) all += filled_after_[line];
  for (std::size_t begin = 0; begin < count_; begin += ImageLines::part) {
    for (std::size_t line = begin; line < std::min(begin + ImageLines::part, count_); ++line)
      all -= filled_after_[line];
    filled_after_[begin / ImageLines::part] = all;
  }
}

float LineComparison::observed_mean(const LineSums& sums) const noexcept {
  const float one_sided = unit_ * square(static_cast<float>(prices_.one_sided));
  return std::max(sums.squares - one_sided * sums.counted, 0.0f) / std::max(sums.filled - sums.counted, 1.0f);
}

LineSums LineComparison::compare(const Kernels& code, const std::uint16_t* sample, float bound,
                                 const std::uint16_t* next) const noexcept {
  constexpr float rounding = 2;  // bound of the error of any cell's cost, in units, and so of the root mean square
  const float most =
      bound < one_sided_ ? square(std::sqrt(bound / unit_) + rounding) : std::numeric_limits<float>::infinity();
  const ImageLines lines{begins_.data(), count_, observed_.data(), counted_.data(), filled_after_.data()};
  LineSums sums = code.compare_lines(lines, sample, prices_, most, next);
  sums.squares *= unit_;
  return sums;
}

Surroundings::Surroundings(const DepthCamera& camera)
    : columns_(camera.columns),
      rows_(camera.rows),
      filled_(columns_ + 2 * reach),
      near_(columns_),
      along_row_(camera.cells()) {}

// Bytes alias members, so the loops' pointers are local.
void Surroundings::limit(std::span<float> observed) noexcept {
  const std::size_t columns = columns_;
  std::uint8_t *const filled = filled_.data(), *const near = near_.data();
  for (std::size_t row = 0; row < rows_; ++row) {
    const float* const depths = &observed[row * columns];
    std::uint8_t* const along = &along_row_[row * columns];
    for (std::size_t c = 0; c < columns; ++c) filled[reach + c] = depths[c] >= 0 ? 1 : 0;
    std::fill_n(along, columns, std::uint8_t{0});
    for (std::size_t shift = 0; shift <= 2 * reach; ++shift)
      for (std::size_t c = 0; c < columns; ++c) along[c] = static_cast<std::uint8_t>(along[c] | filled[c + shift]);
  }
  for (std::size_t row = 0; row < rows_; ++row) {
    std::fill_n(near, columns, std::uint8_t{0});
    for (std::size_t other = row - std::min(row, reach); other < std::min(row + reach + 1, rows_); ++other) {
      const std::uint8_t* const along = &along_row_[other * columns];
      for (std::size_t c = 0; c < columns; ++c) near[c] = static_cast<std::uint8_t>(near[c] | along[c]);
    }
    float* const depths = &observed[row * columns];
    for (std::size_t c = 0; c < columns; ++c) depths[c] = near[c] != 0 ? depths[c] : not_observed;
  }
}

void find_common(std::span<const std::uint16_t> depths, std::span<const RankedSample> samples,
                 std::span<std::uint16_t> common) noexcept {
  std::ranges::fill(common, std::uint16_t{1});
  for (const RankedSample& one : samples) {
    const std::uint16_t* image = &depths[one.sample * common.size()];
    for (std::size_t c = 0; c < common.size(); ++c)
      common[c] = static_cast<std::uint16_t>(common[c] & (image[c] != empty_cell));
  }
}

}  // namespace lbea
