#include "runtime/src/pose/pose_derivatives.hpp"

namespace lbea {
namespace {

using Vec = std::array<float, 3>;

Vec cross(const Vec& a, const Vec& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

/// Without its shift.
Vec rotated(const RigidTransform& T, const Vec& v) noexcept {
  return {T[0] * v[0] + T[1] * v[1] + T[2] * v[2], T[4] * v[0] + T[5] * v[1] + T[6] * v[2],
          T[8] * v[0] + T[9] * v[1] + T[10] * v[2]};
}

// Of the 25 cells of a window: the surface around is known.
constexpr float nearly_all = 20;

}  // namespace

[[gnu::cold]]  // compiled for size
PoseDerivatives::PoseDerivatives(const DepthCamera& camera, const PoseCenter& center, float one_sided)
    : camera_(camera),
      center_(center),
      one_sided_(one_sided),
      of_depths_(6 * padded_cells(camera)),
      common_(padded_cells(camera)),
      stride_(camera.columns + 2 * margin),
      cells_(stride_ * (camera.rows + 2 * margin)),
      in_row_(cells_.size()),
      windows_(cells_.size()) {
  edges_.reserve(camera.cells());
}

void PoseDerivatives::build(const PoseProblem& problem) noexcept {
  std::ranges::fill(of_depths_, 0.0f);
  edges_.clear();
  find_common(problem.images.depths, problem.candidates, common_);
  sum_windows(problem);
  const bool has_silhouette = problem.has_silhouette && is_dense(problem.observed);
  constexpr float all = 25;
  for (std::uint32_t row = 0; row < camera_.rows; ++row)
    for (std::uint32_t column = 0; column < camera_.columns; ++column) {
      const Window& window = windows_[padded(row, column)];
      const bool has_depth = window.filled >= nearly_all && add_depth(problem.observed, row, column);
      if (has_silhouette && window.filled > 0 && window.filled < all && window.hidden == 0)
        add_edge(problem.points, row, column, has_depth);
    }
}

/// In a sparse cloud, most empty cells are gaps between points and not beside the component.
bool PoseDerivatives::is_dense(std::span<const float> observed) const noexcept {
  std::size_t inside = 0, gaps = 0;  // cells between four filled ones
  for (std::size_t row = 1; row + 1 < camera_.rows; ++row)
    for (std::size_t column = 1; column + 1 < camera_.columns; ++column) {
      const std::size_t cell = row * camera_.columns + column;
      if (std::min({observed[cell - 1], observed[cell + 1], observed[cell - camera_.columns],
                    observed[cell + camera_.columns]}) < 0)
        continue;
      ++inside;
      if (observed[cell] < 0) ++gaps;
    }
  constexpr std::size_t fewest = 10;  // times the gaps
  return inside > fewest * gaps;
}

void PoseDerivatives::Window::operator+=(const Window& other) noexcept {
  filled += other.filled;
  depths += other.depths;
  inside += other.inside;
  points += other.points;
  hidden += other.hidden;
}

/// Hidden: cells that all candidates fill, more than `reach` from what the frame shows, so that no small motion
/// explains that they are empty.
void PoseDerivatives::sum_windows(const PoseProblem& problem) noexcept {
  const auto set = [&](const auto& value_of) {
    for (std::uint32_t row = 0; row < camera_.rows; ++row)
      for (std::uint32_t column = 0; column < camera_.columns; ++column)
        cells_[padded(row, column)] = value_of(std::size_t{row} * camera_.columns + column, padded(row, column));
    sum_cells();
  };
  set([&](std::size_t cell, std::size_t) {
    if (problem.observed[cell] < 0) return Window{};
    const float inside = is_inside(problem.observed, cell) ? 1 : 0;
    return Window{1, problem.observed[cell], inside, inside * problem.points[cell]};
  });
  Window whole;
  for (const Window& cell : cells_) whole += cell;
  points_when_full_ = whole.inside > 0 ? whole.points / whole.inside : 0;
  set([&](std::size_t cell, std::size_t at) {
    Window window = cells_[at];
    window.hidden = windows_[at].filled == 0 && common_[cell] != 0 ? 1.0f : 0.0f;
    return window;
  });
}

/// Whether the component fills the cell: its neighbors show it, too.
bool PoseDerivatives::is_inside(std::span<const float> observed, std::size_t cell) const noexcept {
  const std::size_t row = cell / camera_.columns, column = cell % camera_.columns;
  if (row == 0 || column == 0 || row + 1 == camera_.rows || column + 1 == camera_.columns) return false;
  return std::min({observed[cell - 1], observed[cell + 1], observed[cell - camera_.columns],
                   observed[cell + camera_.columns]}) >= 0;
}

void PoseDerivatives::sum_cells() noexcept {
  for (std::size_t at = reach; at + reach < cells_.size(); ++at) {
    Window sum;
    for (std::size_t i = at - reach; i <= at + reach; ++i) sum += cells_[i];
    in_row_[at] = sum;
  }
  for (std::size_t at = reach * stride_; at + reach * stride_ < cells_.size(); ++at) {
    Window sum;
    for (std::size_t i = at - reach * stride_; i <= at + reach * stride_; i += stride_) sum += in_row_[i];
    windows_[at] = sum;
  }
}

std::array<float, 2> PoseDerivatives::ray(std::uint32_t row, std::uint32_t column) const noexcept {
  return {(static_cast<float>(column) + 0.5f - camera_.center_column) / camera_.focal,
          (static_cast<float>(row) + 0.5f - camera_.center_row) / camera_.focal};
}

/// The surface moves along the line of sight by n . motion / (n . ray), n its normal.
bool PoseDerivatives::add_depth(std::span<const float> observed, std::uint32_t row, std::uint32_t column) noexcept {
  if (row == 0 || column == 0 || row + 1 == camera_.rows || column + 1 == camera_.columns) return false;
  const std::size_t cell = std::size_t{row} * camera_.columns + column;
  if (common_[cell] == 0) return false;
  const float left = observed[cell - 1], right = observed[cell + 1], up = observed[cell - camera_.columns],
              down = observed[cell + camera_.columns];
  if (std::min({observed[cell], left, right, up, down}) < 0) return false;
  const float z = camera_.depth_origin + camera_.depth_step * observed[cell];
  const float slope = camera_.depth_step * camera_.focal / (2 * z);  // per difference over two cells
  const float u = slope * (right - left), v = slope * (down - up);
  constexpr float steepest = 3;  // what is steeper against the image plane is an edge
  if (!(std::abs(u) < steepest && std::abs(v) < steepest)) return false;
  const auto at = ray(row, column);
  const auto values = derivative(at, z, {-u, -v, 1 + at[0] * u + at[1] * v});
  for (std::size_t i = 0; i < 6; ++i) of_depths_[i * (of_depths_.size() / 6) + cell] = values[i];
  return true;
}

/// The share of filled cells in the window moves with the image (optical flow). All windows that the edge crosses
/// count: the change of the one cell that it moves through is spread over them. The component fills less than the cells
/// at its edge: only those inside tell how many points a full cell has.
void PoseDerivatives::add_edge(std::span<const float> points, std::uint32_t row, std::uint32_t column,
                               bool has_depth) noexcept {
  const std::size_t cell = std::size_t{row} * camera_.columns + column, at = padded(row, column);
  const Window& window = windows_[at];
  constexpr float cells = (2 * reach + 1) * (2 * reach + 1);
  const float z = camera_.depth_origin + camera_.depth_step * window.depths / window.filled;
  const float scale = -one_sided_ * camera_.depth_step * camera_.focal / (2 * cells * z);
  const float u = scale * (windows_[at + 1].filled - windows_[at - 1].filled);
  const float v = scale * (windows_[at + stride_].filled - windows_[at - stride_].filled);
  const auto through = ray(row, column);
  const float full = window.points > 0 ? window.points / window.inside : points_when_full_;
  const float share = full > 0 ? std::min(points[cell] / full, 1.0f) : 0;
  edges_.push_back({static_cast<std::uint32_t>(cell), has_depth, share,
                    derivative(through, z, {u, v, -through[0] * u - through[1] * v})});
}

/// by_shift: by a shift along the camera's axes, length per length.
std::array<float, 6> PoseDerivatives::derivative(std::array<float, 2> ray, float depth,
                                                 const Vec& by_shift) const noexcept {
  const RigidTransform& T = camera_.T_reference_sensor;
  Vec from_middle = rotated(T, {depth * ray[0], depth * ray[1], depth});
  for (std::size_t i = 0; i < 3; ++i) from_middle[i] += T[4 * i + 3] - static_cast<float>(center_.middle[i]);
  Vec shift = rotated(T, by_shift);
  for (float& value : shift) value /= camera_.depth_step;
  const Vec turn = cross(from_middle, shift);
  const auto arm = static_cast<float>(center_.arm);
  return {turn[0] / arm, turn[1] / arm, turn[2] / arm, shift[0], shift[1], shift[2]};
}

}  // namespace lbea
