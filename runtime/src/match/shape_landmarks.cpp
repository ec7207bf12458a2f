#include "runtime/src/match/shape_landmarks.hpp"

namespace lbea {
namespace {

/// Of the nodes or, if there are any, of the model's landmarks.
std::vector<std::uint32_t> chosen_places(const ModelView& model, LandmarkPlaces chosen) {
  const bool is_surface = chosen == LandmarkPlaces::surface, has_landmarks = !model.landmark_positions.empty();
  const std::uint32_t surface = format::surface_landmarks(model.info.vertices),
                      mesh = format::mesh_landmarks(model.info.nodes);
  const std::uint32_t all = !is_surface ? mesh : has_landmarks ? surface : model.info.vertices;
  std::vector<std::uint32_t> places(std::min(is_surface ? most_surface_places : most_component_places, all));
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const std::uint32_t one = format::part_begin(i, places.size(), all);
    if (has_landmarks)
      places[i] = is_surface ? one : surface + one;
    else
      places[i] =
          is_surface ? model.references.front().vertex_nodes[one] : format::part_begin(one, mesh, model.info.nodes);
  }
  return places;
}

}  // namespace

[[gnu::cold]]  // compiled for size
ShapeLandmarks::ShapeLandmarks(const ModelView& model, LandmarkPlaces places, std::size_t most_bytes)
    : model_(model), code_(kernels()), places_(chosen_places(model, places)), stride_(format::padded(places_.size())) {
  const std::size_t samples = model.info.samples;
  if (samples * size() * sizeof(float) > most_bytes) return;
  copies_.resize(samples * size());
  for (std::uint32_t s = 0; s < samples; ++s) read(s, std::span(copies_).subspan(s * size(), size()));
}

void ShapeLandmarks::read(std::uint32_t sample, std::span<float> into) const noexcept {
  const float* positions = model_.landmark_positions.empty()
                               ? model_.node_positions.data() + std::size_t{3} * model_.info.nodes * sample
                               : model_.landmarks(sample).data();
  for (std::size_t i = 0; i < places_.size(); ++i)
    for (std::size_t axis = 0; axis < 3; ++axis)
      into[axis * stride_ + i] = positions[std::size_t{3} * places_[i] + axis];
}

std::span<const float> ShapeLandmarks::of(std::uint32_t sample, bool copies, std::span<float> buffer) const noexcept {
  if (copies && !copies_.empty()) return std::span(copies_).subspan(sample * size(), size());
  read(sample, buffer);
  return buffer;
}

float ShapeLandmarks::mean_distance(std::span<const float> a, std::span<const float> b) const noexcept {
  const float* const planes[3] = {&a[0], &a[stride_], &a[2 * stride_]};
  return code_.mode_distance(planes, b.data(), stride_, std::numeric_limits<float>::infinity()) /
         static_cast<float>(places_.size());
}

}  // namespace lbea
