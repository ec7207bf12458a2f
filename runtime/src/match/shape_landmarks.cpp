#include "runtime/src/match/shape_landmarks.hpp"

namespace lbea {
namespace {

using Place = std::array<std::uint32_t, 2>;

/// So many of all, evenly.
std::vector<Place> spread(std::uint32_t count, std::uint32_t all, const auto& node) {
  std::vector<Place> places(std::min(count, all));
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const std::uint32_t one = node(format::part_begin(i, places.size(), all));
    places[i] = {one, one};
  }
  return places;
}

/// Of the model's landmarks or, if there are none, of its nodes.
SurfacePlaces chosen_places(const ModelView& model, bool is_surface) {
  const std::uint32_t surface = format::surface_landmarks(model.info.vertices),
                      mesh = format::mesh_landmarks(model.info.nodes);
  if (!model.landmark_positions.empty()) {
    const std::uint32_t first = is_surface ? 0 : surface;
    return {spread(is_surface ? most_surface_places : most_component_places, is_surface ? surface : mesh,
                   [&](std::uint32_t one) { return first + one; }),
            is_surface ? model.landmark_edges : 0};
  }
  if (!is_surface)
    return {spread(most_component_places, mesh,
                   [&](std::uint32_t one) { return format::part_begin(one, mesh, model.info.nodes); }),
            0};
  if (model.references.empty()) return {};
  return surface_places(model.references.front().vertex_nodes, model.element_nodes, model.info.nodes, false);
}

struct OpenEdge {
  Place opposite, corner, nodes;
};

/// The sides of elements that are sides of no other element, on the observed surface.
std::vector<OpenEdge> open_edges(std::span<const std::array<std::uint32_t, 4>> element_nodes,
                                 const std::vector<bool>& is_observed) {
  const auto side = [&](std::size_t number) {  // 4 times the element, and a corner
    const auto node = [&](std::size_t further) { return element_nodes[number / 4][(number + further) % 4]; };
    OpenEdge edge{{node(2), node(3)}, {node(0), node(0)}, {node(0), node(1)}};
    for (const std::size_t k : {0u, 1u})  // of a triangle, the third node
      if (edge.opposite[k] == node(k == 0 ? 1 : 0)) edge.opposite[k] = edge.opposite[1 - k];
    return edge;
  };
  std::vector<std::pair<std::uint64_t, std::size_t>> sides;  // by their nodes
  for (std::size_t number = 0; number < 4 * element_nodes.size(); ++number)
    if (const auto [a, b] = side(number).nodes; a != b)
      sides.push_back({std::uint64_t{std::min(a, b)} << 32 | std::max(a, b), number});
  std::ranges::sort(sides);
  const auto is_same = [&](std::size_t i, std::size_t j) {
    return j < sides.size() && sides[i].first == sides[j].first;
  };
  const auto are_observed = [&](const Place& both) { return is_observed[both[0]] && is_observed[both[1]]; };
  std::vector<OpenEdge> open;
  for (std::size_t i = 0; i < sides.size(); ++i) {
    const OpenEdge edge = side(sides[i].second);
    if (!is_same(i, i - 1) && !is_same(i, i + 1) && are_observed(edge.nodes) && are_observed(edge.opposite))
      open.push_back(edge);
  }
  return open;
}

}  // namespace

SurfacePlaces surface_places(std::span<const std::uint32_t> vertex_nodes,
                             std::span<const std::array<std::uint32_t, 4>> element_nodes, std::size_t nodes,
                             bool has_landmarks) {
  std::vector<bool> is_observed(nodes);
  for (const std::uint32_t node : vertex_nodes) is_observed[node] = true;
  std::vector<OpenEdge> open;
  if (!has_landmarks) open = open_edges(element_nodes, is_observed);
  const auto edges = std::min(static_cast<std::uint32_t>(open.size()), most_edge_places);
  SurfacePlaces places{spread(most_surface_places - 3 * edges, static_cast<std::uint32_t>(vertex_nodes.size()),
                              [&](std::uint32_t one) { return vertex_nodes[one]; }),
                       edges};
  for (const auto of_edge : {&OpenEdge::opposite, &OpenEdge::corner, &OpenEdge::nodes})
    for (std::uint32_t i = 0; i < edges; ++i)
      places.between.push_back(open[format::part_begin(i, edges, open.size())].*of_edge);
  return places;
}

[[gnu::cold]]  // compiled for size
ShapeLandmarks::ShapeLandmarks(const ModelView& model, LandmarkPlaces places, std::size_t most_bytes)
    : model_(model),
      code_(kernels()),
      places_(chosen_places(model, places == LandmarkPlaces::surface)),
      stride_(format::padded(nodes())) {
  const std::size_t samples = model.info.samples;
  if (samples * size() * sizeof(float) > most_bytes) return;
  copies_.resize(samples * size());
  for (std::uint32_t s = 0; s < samples; ++s) read(s, std::span(copies_).subspan(s * size(), size()));
}

void ShapeLandmarks::read(std::uint32_t sample, std::span<float> into) const noexcept {
  const float* positions = model_.landmark_positions.empty()
                               ? model_.node_positions.data() + std::size_t{3} * model_.info.nodes * sample
                               : model_.landmarks(sample).data();
  for (std::size_t i = 0; i < nodes(); ++i) {
    const auto [a, b] = places_.between[i];
    const auto place = SurfacePlaces::middle(&positions[std::size_t{3} * a], &positions[std::size_t{3} * b]);
    for (std::size_t axis = 0; axis < 3; ++axis) into[axis * stride_ + i] = place[axis];
  }
}

std::span<const float> ShapeLandmarks::of(std::uint32_t sample, bool copies, std::span<float> buffer) const noexcept {
  if (copies && !copies_.empty()) return std::span(copies_).subspan(sample * size(), size());
  read(sample, buffer);
  return buffer;
}

float ShapeLandmarks::mean_distance(std::span<const float> a, std::span<const float> b) const noexcept {
  const float* const planes[3] = {&a[0], &a[stride_], &a[2 * stride_]};
  return code_.mode_distance(planes, b.data(), stride_, std::numeric_limits<float>::infinity()) /
         static_cast<float>(nodes());
}

}  // namespace lbea
