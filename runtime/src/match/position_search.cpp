#include "runtime/src/match/position_search.hpp"

#include <algorithm>
#include <numeric>

namespace lbea {
namespace {
constexpr std::size_t most_groups = 128;
constexpr std::uint32_t most_nearest = 8;
constexpr float infinity = std::numeric_limits<float>::infinity();
constexpr double unit = 0x1p-24;  // of the relative rounding error
}  // namespace

[[gnu::cold]]  // compiled for size
PositionSearch::PositionSearch(const ModelView& model, const ReferenceView& reference, const Kernels& code)
    : model_(model),
      reference_(reference),
      code_(code),
      n_(reference.vertex_positions.size()),
      group_(lanes * ((n_ + lanes * most_groups - 1) / (lanes * most_groups))),
      groups_((n_ + group_ - 1) / group_),
      stride_(format::padded(groups_)),
      sums_(3 * stride_ * model.info.samples),
      frame_sums_(3 * stride_),
      bounds_(model.info.samples),
      order_(groups_),
      excesses_(groups_),
      nearest_(std::min(model.info.samples, most_nearest)) {
  std::iota(order_.begin(), order_.end(), 0u);
  Positions positions(n_);
  for (std::uint32_t s = 0; s < model.info.samples; ++s) {
    for (std::size_t i = 0; i < n_; ++i) positions.set(i, {position(s, i)[0], position(s, i)[1], position(s, i)[2]});
    largest_ = std::max(largest_, add_up(positions, std::span(sums_).subspan(3 * stride_ * s, 3 * stride_)));
  }
}

/// Displacements, because sums of positions would be large and their roundings, too. Returns the sum of |x| + |y| +
/// |z|.
double PositionSearch::add_up(const Positions& positions, std::span<float> sums) const noexcept {
  double all = 0;
  for (std::size_t g = 0; g < groups_; ++g) {
    double sum[3]{};
    for (std::size_t i = g * group_; i < std::min((g + 1) * group_, n_); ++i) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const double displacement = double{positions.planes[axis][i]} - double{reference_.vertex_positions[i][axis]};
        sum[axis] += displacement;
        all += std::abs(displacement);
      }
    }
    for (std::size_t axis = 0; axis < 3; ++axis) sums[axis * stride_ + g] = static_cast<float>(sum[axis]);
  }
  return all;
}

// Halves, quarters, eighths, sixteenths.
float PositionSearch::Lengths::sum() const noexcept {
  float part[lanes];
  std::ranges::copy(of_lane, part);
  for (std::size_t half = lanes / 2; half > 0; half /= 2)
    for (std::size_t i = 0; i < half; ++i) part[i] += part[i + half];
  return part[0];
}

void PositionSearch::add_lengths(const Positions& e, std::uint32_t sample, std::size_t begin, std::size_t end,
                                 Lengths& lengths) const noexcept {
  for (std::size_t first = begin; first < end; first += lanes) {
    float d[3][lanes]{};
    const std::size_t count = std::min(lanes, end - first);
    for (std::size_t i = 0; i < count; ++i) {
      const float* at = position(sample, first + i);
      for (std::size_t axis = 0; axis < 3; ++axis) d[axis][i] = e.planes[axis][first + i] - at[axis];
    }
    for (std::size_t i = 0; i < lanes; ++i)
      lengths.of_lane[i] += std::sqrt(d[0][i] * d[0][i] + d[1][i] * d[1][i] + d[2][i] * d[2][i]);
  }
}

float PositionSearch::distance(const Positions& e, std::uint32_t sample) const noexcept {
  Lengths lengths;
  add_lengths(e, sample, 0, n_, lengths);
  return lengths.sum() / static_cast<float>(n_);
}

// The sums' relative rounding error is `unit`, of their sum over groups at most the same share of that over vertices.
void PositionSearch::bound_all(const Positions& e) noexcept {
  const double size = add_up(e, frame_sums_);
  constexpr double vanishing = 1e-18;  // shorter lengths have squares below the least float
  margin_ = static_cast<float>(2 * unit * (size + largest_) + vanishing * static_cast<double>(n_));
  const float* const planes[3] = {frame_sums_.data(), frame_sums_.data() + stride_, frame_sums_.data() + 2 * stride_};
  nearest_.clear();
  for (std::uint32_t s = 0; s < bounds_.size(); ++s) {
    bounds_[s] = code_.mode_distance(planes, sums(s), stride_, infinity);
    nearest_.offer(s, bounds_[s]);
  }
}

// Bounds and distances are sums of rounded terms: those of a lane, of a group, and the parts subtracted from a bound.
// All their roundings are less than half of the slack.
float PositionSearch::limit(const BestSamples& best) const noexcept {
  const auto slack = static_cast<float>(2 * unit * static_cast<double>(n_ / lanes + 2 * groups_ + 32));
  return best.bound() * static_cast<float>(n_) * (1 + slack) + margin_;
}

float PositionSearch::excess(const Positions& e, std::uint32_t sample, std::uint32_t group) const noexcept {
  Lengths lengths;
  add_lengths(e, sample, group * group_, std::min((group + 1) * group_, n_), lengths);
  const float *const of_frame = frame_sums_.data() + group, *const of_sample = sums(sample) + group;
  const float dx = of_frame[0] - of_sample[0], dy = of_frame[stride_] - of_sample[stride_],
              dz = of_frame[2 * stride_] - of_sample[2 * stride_];
  return lengths.sum() - std::sqrt(dx * dx + dy * dy + dz * dz);
}

bool PositionSearch::is_excluded(const Positions& e, std::uint32_t sample, const BestSamples& best) const noexcept {
  const float most = limit(best);
  float bound = bounds_[sample];
  for (std::size_t i = 0; i < groups_ && bound <= most; ++i) bound += excess(e, sample, order_[i]);
  return bound > most;
}

void PositionSearch::order_groups(const Positions& e) noexcept {
  std::ranges::fill(excesses_, 0.0f);
  for (const RankedSample& near : nearest_.ranked())
    for (std::uint32_t g = 0; g < groups_; ++g) excesses_[g] += excess(e, near.sample, g);
  std::ranges::sort(order_, std::ranges::greater(), [&](std::uint32_t g) { return excesses_[g]; });
}

void PositionSearch::search(const Positions& e, BestSamples& best) noexcept {
  best.clear();
  bound_all(e);
  for (const RankedSample& near : nearest_.ranked()) {
    best.offer(near.sample, distance(e, near.sample));
    bounds_[near.sample] = infinity;
  }
  order_groups(e);
  for (std::uint32_t s = 0; s < bounds_.size(); ++s)
    if (bounds_[s] < infinity && !is_excluded(e, s, best)) best.offer(s, distance(e, s));
}
}  // namespace lbea
