#include "runtime/src/match/correspondence.hpp"

#include "runtime/src/match/shape_landmarks.hpp"

#include <cstring>

namespace lbea {
namespace {
constexpr std::size_t group = CloudIndex::fanout;

// Sixteen queries, which the index answers together.
struct Group {
  float planes[3][group];
  std::uint32_t hints[group];
  NearestPoints nearest;

  void set(std::size_t i, const std::array<float, 3>& position, std::uint32_t hint) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis) planes[axis][i] = position[axis];
    hints[i] = hint;
  }
  void search(const CloudIndex& index, float squared) noexcept {
    const float* const queries[3] = {planes[0], planes[1], planes[2]};
    std::ranges::fill(nearest.squared, squared);
    std::ranges::fill(nearest.point, NearestPoint::none);
    index.nearest_16(queries, hints, nearest);
  }
};

float squared_distance(const std::array<float, 3>& a, const std::array<float, 3>& b) noexcept {
  const float dx = a[0] - b[0], dy = a[1] - b[1], dz = a[2] - b[2];
  return dx * dx + dy * dy + dz * dz;
}

// The hint decides most positions; the others are collected and searched sixteen at a time.
class ShownSearch {
 public:
  ShownSearch(const CloudIndex& index, float distance, std::span<std::uint8_t> is_shown)
      : index_(index), squared_(distance * distance), is_shown_(is_shown) {
    waiting_.nearest.tests_left = most_hard_tests(index, is_shown.size());
  }

  void add(std::size_t place, const std::array<float, 3>& position) noexcept {
    const std::uint32_t hint = index_.hint(position);
    is_shown_[place] = hint != NearestPoint::none && squared_distance(index_.position(hint), position) <= squared_;
    if (is_shown_[place]) return;
    waiting_.set(count_, position, NearestPoint::none);
    places_[count_] = place;
    if (++count_ == group) search_waiting();
  }
  void search_waiting() noexcept {
    if (count_ == 0) return;
    for (std::size_t i = count_; i < group; ++i)
      waiting_.set(i, {waiting_.planes[0][0], waiting_.planes[1][0], waiting_.planes[2][0]}, NearestPoint::none);
    waiting_.search(index_, squared_);
    for (std::size_t i = 0; i < count_; ++i) is_shown_[places_[i]] = waiting_.nearest.point[i] != NearestPoint::none;
    count_ = 0;
  }

 private:
  const CloudIndex& index_;
  float squared_;
  std::span<std::uint8_t> is_shown_;
  Group waiting_;
  std::size_t places_[group];
  std::size_t count_ = 0;
};

// The mass of the vertices that each of `count` places represents. Every reference has the same nodes, in a different
// order.
std::vector<double> masses(const ModelView& model, const ReferenceView& reference, std::size_t count) {
  const std::uint32_t n = model.info.vertices;
  std::vector<std::size_t> place_of_node(model.info.nodes);
  for (std::size_t k = 0; k < count; ++k)
    for (std::uint32_t v = format::part_begin(k, count, n); v < format::part_begin(k + 1, count, n); ++v)
      place_of_node[model.references.front().vertex_nodes[v]] = k;
  std::vector<double> sums(count);
  for (std::uint32_t v = 0; v < n; ++v) sums[place_of_node[reference.vertex_nodes[v]]] += reference.mass[v];
  return sums;
}
}  // namespace

std::uint32_t most_hard_tests(const CloudIndex& index, std::size_t vertices) noexcept {
  constexpr std::size_t per_leaf = 2, per_vertex = 4;
  if (!index.is_crowded()) return NearestPoints::unlimited;
  return static_cast<std::uint32_t>(per_leaf * (index.size() / CloudIndex::fanout) + per_vertex * vertices);
}

std::uint32_t correspond(const CloudIndex& index, std::span<const std::array<float, 3>> vertices,
                         Positions& corresponding, std::span<std::uint32_t> points, std::uint32_t most_tests) noexcept {
  constexpr float anywhere = std::numeric_limits<float>::infinity();
  Group queries;
  queries.nearest.tests_left = most_tests;
  std::uint32_t cut = 0;
  std::uint32_t hint = 0;  // without a hint of its own, a vertex uses the previous one
  for (std::size_t begin = 0; begin < vertices.size(); begin += group) {
    for (std::size_t i = 0; i < group; ++i) {
      const std::size_t v = std::min(begin + i, vertices.size() - 1);  // beyond the end: the last one repeated
      const std::uint32_t known = index.hint(index.is_crowded() ? vertices[v] : corresponding[v]);
      if (known != NearestPoint::none) hint = known;
      queries.set(i, vertices[v], hint);
    }
    queries.search(index, anywhere);
    const std::size_t count = std::min(group, vertices.size() - begin);
    if (queries.nearest.is_cut) cut += static_cast<std::uint32_t>(count);
    for (std::size_t i = 0; i < count; ++i) {
      corresponding.set(begin + i, index.position(queries.nearest.slot[i]));
      if (!points.empty()) points[begin + i] = queries.nearest.point[i];
    }
  }
  return cut;
}

[[gnu::cold]]  // compiled for size
ObservedSurface::ObservedSurface(const ModelView& model, std::size_t places)
    : model_(model) {
  if (places == 0 && !model.landmark_positions.empty()) places = format::surface_landmarks(model.info.vertices);
  positions_.resize(places > 0 ? places : model.info.vertices);
  is_shown_.resize(positions_.size());
  is_unseen_.resize(positions_.size());
  if (places == 0) return;
  for (const ReferenceView& reference : model.references) part_mass_.push_back(masses(model, reference, places));
}

void ObservedSurface::take(std::span<const float> planes, std::size_t stride) noexcept {
  for (std::size_t i = 0; i < positions_.size(); ++i) positions_[i] = vector_at(planes, stride, i);
}

void ObservedSurface::take(std::uint32_t sample, const ReferenceView& reference) noexcept {
  if (!model_.landmark_positions.empty()) {
    std::memcpy(positions_.data(), model_.landmarks(sample).data(), positions_.size() * sizeof(positions_.front()));
    return;
  }
  const float* const nodes = model_.node_positions.data() + std::size_t{3} * model_.info.nodes * sample;
  for (std::size_t v = 0; v < positions_.size(); ++v)
    std::memcpy(&positions_[v], nodes + std::size_t{3} * reference.vertex_nodes[v], sizeof(positions_[v]));
}

void ObservedSurface::leave_out_unseen(const DepthCamera& camera, std::span<const std::uint16_t> image) noexcept {
  constexpr float farthest_behind = 2;  // in cells
  for (std::size_t i = 0; i < positions_.size(); ++i) {
    const auto [depth, cell] = camera.place_of(positions_[i]);
    const std::uint16_t shown = cell < camera.cells() ? image[cell] : empty_cell;
    const float behind = depth - (camera.depth_origin + camera.depth_step * static_cast<float>(shown));
    is_unseen_[i] = shown == empty_cell || behind > farthest_behind * depth / camera.focal;
  }
}

[[gnu::cold]] void ObservedSurface::add(const ObservedSurface& other) noexcept {
  for (std::size_t i = 0; i < is_shown_.size(); ++i) {
    is_shown_[i] |= other.is_shown_[i];
    is_unseen_[i] &= other.is_unseen_[i];
  }
}

[[gnu::cold]] float ObservedSurface::coverage(const ReferenceView& reference) const noexcept {
  const auto mass =
      part_mass_.empty()
          ? reference.mass
          : std::span<const double>(part_mass_[static_cast<std::size_t>(&reference - model_.references.data())]);
  return share_shown(is_shown_, mass, is_unseen_);
}

void find_shown(const CloudIndex& index, std::span<const std::array<float, 3>> positions, float distance,
                std::span<std::uint8_t> is_shown) noexcept {
  ShownSearch search(index, distance, is_shown);
  for (std::size_t i = 0; i < positions.size(); ++i) search.add(i, positions[i]);
  search.search_waiting();
}

[[gnu::cold]] float share_shown(std::span<const std::uint8_t> is_shown, std::span<const double> mass,
                                std::span<const std::uint8_t> is_unseen) noexcept {
  double shown = 0, all = 0;
  for (std::size_t i = 0; i < is_shown.size(); ++i) {
    if (is_shown[i]) shown += mass[i];
    if (is_shown[i] || is_unseen.empty() || !is_unseen[i]) all += mass[i];
  }
  return all > 0 ? static_cast<float>(shown / all) : 0;
}
}  // namespace lbea
