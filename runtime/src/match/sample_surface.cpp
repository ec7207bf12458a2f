#include "runtime/src/match/sample_surface.hpp"

#include <cstring>

namespace lbea {
namespace {

std::span<const float> landmarks(const ModelView& model, std::uint32_t sample) noexcept {
  const std::size_t floats = model.landmark_positions.size() / model.info.samples;
  return model.landmark_positions.subspan(sample * floats, floats);
}

/// The mass of the vertices that each landmark represents. Every reference has the same nodes, in a different order.
std::vector<double> masses(const ModelView& model, const ReferenceView& reference) {
  const std::uint32_t n = model.info.vertices, count = format::surface_landmarks(n);
  std::vector<std::uint32_t> landmark_of_node(model.info.nodes);
  for (std::uint32_t k = 0; k < count; ++k)
    for (std::uint32_t v = format::part_begin(k, count, n); v < format::part_begin(k + 1, count, n); ++v)
      landmark_of_node[model.references.front().vertex_nodes[v]] = k;
  std::vector<double> sums(count);
  for (std::uint32_t v = 0; v < n; ++v) sums[landmark_of_node[reference.vertex_nodes[v]]] += reference.mass[v];
  return sums;
}

}  // namespace

SampleSurface::SampleSurface(const ModelView& model) : model_(model) {
  const bool has_landmarks = !model.landmark_positions.empty();
  positions_.resize(has_landmarks ? format::surface_landmarks(model.info.vertices) : model.info.vertices);
  if (!has_landmarks) return;
  for (const ReferenceView& reference : model.references) landmark_mass_.push_back(masses(model, reference));
}

void SampleSurface::take(std::uint32_t sample, const ReferenceView& reference) noexcept {
  if (!landmark_mass_.empty()) {
    std::memcpy(positions_.data(), landmarks(model_, sample).data(), positions_.size() * sizeof(positions_.front()));
    return;
  }
  const float* const nodes = model_.node_positions.data() + std::size_t{3} * model_.info.nodes * sample;
  for (std::size_t v = 0; v < positions_.size(); ++v)
    std::memcpy(&positions_[v], nodes + std::size_t{3} * reference.vertex_nodes[v], sizeof(positions_[v]));
}

std::span<const double> SampleSurface::mass(const ReferenceView& reference) const noexcept {
  if (landmark_mass_.empty()) return reference.mass;
  return landmark_mass_[static_cast<std::size_t>(&reference - model_.references.data())];
}

std::span<const float> mesh_landmarks(const ModelView& model, std::uint32_t sample) noexcept {
  return landmarks(model, sample).subspan(std::size_t{3} * format::surface_landmarks(model.info.vertices));
}

}  // namespace lbea
