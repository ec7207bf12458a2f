#include "runtime/src/match/sample_search.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace lbea {
namespace {
constexpr std::size_t most_leading = 24;
constexpr float infinity = std::numeric_limits<float>::infinity();

// Bound of the relative rounding error of a distance: a sum of up to some thousand roots in float, with a margin.
constexpr float rounding = 1e-4f;

struct Spread {
  double sum = 0, squares = 0;
  void add(double value) noexcept { sum += value, squares += value * value; }
  [[nodiscard]] double variance(double count) const noexcept { return squares / count - sum / count * (sum / count); }
};

std::vector<std::size_t> leading_coefficients(std::span<const float> table, std::size_t row) {
  std::vector<Spread> spreads(row);
  for (std::size_t i = 0; i < table.size(); ++i) spreads[i % row].add(double{table[i]});
  const double count = static_cast<double>(table.size() / row);
  std::vector<std::size_t> order(row);
  std::iota(order.begin(), order.end(), std::size_t{0});
  const std::size_t leading = std::min(row, most_leading);
  std::ranges::partial_sort(order, order.begin() + static_cast<std::ptrdiff_t>(leading), std::ranges::less(),
                            [&](std::size_t i) { return std::pair(-spreads[i].variance(count), i); });
  order.resize(leading);
  return order;
}

// Prefetches the leading modes, at which most comparisons end: consecutive samples are not adjacent in memory.
void prefetch(const float* sample, std::size_t stride) noexcept {
  constexpr std::size_t line = 16, modes = 32;
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t j = 0; j < std::min(modes, stride); j += line) __builtin_prefetch(sample + axis * stride + j);
}
}  // namespace

void project(std::span<const float> projection, const Positions& positions, Positions& coefficients) noexcept {
  for (std::size_t axis = 0; axis < 3; ++axis)
    kernels().project(projection.data(), coefficients.count, positions.planes[axis].size(),
                      positions.planes[axis].data(), coefficients.planes[axis].data());
}

void BestSamples::offer(std::uint32_t sample, float distance) noexcept {
  constexpr float farthest = std::numeric_limits<float>::max();
  const RankedSample one{sample, distance <= farthest ? distance : farthest};
  if (size_ == ranked_.size() && !is_before(one, ranked_.back())) return;
  if (size_ < ranked_.size()) ++size_;
  std::size_t place = size_ - 1;
  for (; place > 0 && is_before(one, ranked_[place - 1]); --place) ranked_[place] = ranked_[place - 1];
  ranked_[place] = one;
}

[[gnu::cold]]  // compiled for size
void put_nearest_first(std::span<RankedSample> samples, std::size_t count) noexcept {
  std::nth_element(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(count - 1), samples.end(), is_before);
}

void SelectedSamples::select() noexcept {
  put_nearest_first(std::span(kept_).first(size_), capacity_);
  size_ = capacity_;
}

std::span<const RankedSample> SelectedSamples::selected(std::size_t first) noexcept {
  if (size_ > capacity_) select();
  if (first > 0 && first < size_) put_nearest_first(std::span(kept_).first(size_), first);
  return std::span(kept_).first(size_);
}

void search_lbea(const ReferenceView& reference, const Positions& coefficients, BestSamples& best) noexcept {
  const Kernels& code = kernels();
  const std::size_t stride = coefficients.planes[0].size();
  const float* const e[3] = {coefficients.planes[0].data(), coefficients.planes[1].data(),
                             coefficients.planes[2].data()};
  const std::size_t samples = reference.coefficients.size() / (3 * stride);
  best.clear();
  for (std::size_t s = 0; s < samples; ++s) {
    const float* sample = reference.coefficients.data() + 3 * stride * s;
    best.offer(static_cast<std::uint32_t>(s), code.mode_distance(e, sample, stride, best.bound()));
  }
}

struct SampleTree::Search {
  const float* e[3];
  BestSamples& best;
  float bound;  // no sample beyond it is among the best

  void update() noexcept { bound = std::min(bound, best.bound()); }
};

[[gnu::cold]]  // compiled for size
SampleTree::SampleTree(std::span<const float> coefficients, std::size_t modes)
    : code_(kernels()),
      coefficients_(coefficients),
      stride_(format::padded(modes)),
      leading_(leading_coefficients(coefficients, 3 * stride_)),
      order_(coefficients.size() / (3 * stride_)),
      from_center_(order_.size()) {
  std::iota(order_.begin(), order_.end(), 0u);
  if (!order_.empty()) build(0, static_cast<std::uint32_t>(order_.size()));
}

// Halves the samples along the leading coefficient that varies most among them.
[[gnu::cold]] std::uint32_t SampleTree::build(std::uint32_t begin, std::uint32_t end) {
  const auto self = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({begin, end, 0, 0});
  centers_.resize(nodes_.size() * 3 * stride_);
  enclose(nodes_[self]);
  if (end - begin > leaf_size) {
    const std::size_t by = widest(begin, end);
    const std::uint32_t middle = begin + (end - begin) / 2;
    std::nth_element(order_.begin() + begin, order_.begin() + middle, order_.begin() + end,
                     [&](std::uint32_t a, std::uint32_t b) { return sample(a)[by] < sample(b)[by]; });
    build(begin, middle);
    const std::uint32_t right = build(middle, end);
    nodes_[self].right = right;
  }
  return self;
}

// Not inlined: build() is compiled for size.
[[gnu::noinline]] void SampleTree::enclose(Node& node) {
  float* const middle = centers_.data() + centers_.size() - 3 * stride_;
  const float share = 1 / static_cast<float>(node.end - node.begin);
  for (std::uint32_t i = node.begin; i < node.end; ++i)
    for (std::size_t c = 0; c < 3 * stride_; ++c) middle[c] += share * sample(order_[i])[c];
  const float* const planes[3] = {middle, middle + stride_, middle + 2 * stride_};
  for (std::uint32_t i = node.begin; i < node.end; ++i) {
    from_center_[i] = code_.mode_distance(planes, sample(order_[i]), stride_, infinity);
    node.radius = std::max(node.radius, from_center_[i]);
  }
}

[[gnu::cold]] std::size_t SampleTree::widest(std::uint32_t begin, std::uint32_t end) const {
  std::vector<Spread> spreads(leading_.size());
  for (std::uint32_t i = begin; i < end; ++i)
    for (std::size_t k = 0; k < leading_.size(); ++k) spreads[k].add(double{sample(order_[i])[leading_[k]]});
  const double count = end - begin;
  const auto most = std::ranges::max_element(spreads, {}, [&](const Spread& spread) { return spread.variance(count); });
  return leading_[static_cast<std::size_t>(most - spreads.begin())];
}

void SampleTree::search(const Positions& coefficients, BestSamples& best) const noexcept {
  Search search{
      {coefficients.planes[0].data(), coefficients.planes[1].data(), coefficients.planes[2].data()}, best, infinity};
  if (best.ranked().size() == best.capacity()) {  // the farthest of the earlier result bounds this one
    search.bound = 0;
    for (const RankedSample& before : best.ranked())
      search.bound = std::max(search.bound, code_.mode_distance(search.e, sample(before.sample), stride_, infinity));
  }
  best.clear();
  if (!nodes_.empty()) visit(search, 0, code_.mode_distance(search.e, center(0), stride_, infinity));
}

// `distance`: from the node's center, or a smaller value that already excludes the node.
void SampleTree::visit(Search& search, std::uint32_t at, float distance) const noexcept {
  const Node& node = nodes_[at];
  const auto is_beyond = [&](float d, float radius) { return d - radius > search.bound + rounding * (d + radius); };
  if (is_beyond(distance, node.radius)) return;
  if (node.right == 0) return visit_leaf(search, node, distance);
  const std::uint32_t children[2] = {at + 1, node.right};
  float distances[2];
  for (std::size_t i = 0; i < 2; ++i) {
    const float enough = (search.bound + nodes_[children[i]].radius) * (1 + 4 * rounding);
    distances[i] = code_.mode_distance(search.e, center(children[i]), stride_, enough);
  }
  const std::size_t nearer = distances[1] < distances[0] ? 1 : 0;
  visit(search, children[nearer], distances[nearer]);
  visit(search, children[1 - nearer], distances[1 - nearer]);
}

// mode_distance() may stop early at the bound: a tie is computed again without a bound.
void SampleTree::visit_leaf(Search& search, const Node& node, float distance_of_center) const noexcept {
  for (std::uint32_t i = node.begin; i < node.end; ++i) {
    if (std::abs(distance_of_center - from_center_[i]) >
        search.bound + rounding * (distance_of_center + from_center_[i]))
      continue;
    const float* const other = sample(order_[i]);
    if (i + 1 < node.end) prefetch(sample(order_[i + 1]), stride_);
    float distance = code_.mode_distance(search.e, other, stride_, search.bound);
    if (distance == search.bound) distance = code_.mode_distance(search.e, other, stride_, infinity);
    if (distance > search.bound) continue;
    search.best.offer(order_[i], distance);
    search.update();
  }
}
}  // namespace lbea
