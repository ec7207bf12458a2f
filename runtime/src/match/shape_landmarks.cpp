#include "runtime/src/match/shape_landmarks.hpp"

namespace lbea {
namespace {

// Of the model's landmarks of the whole mesh.
std::vector<std::uint32_t> chosen_places(const ModelView& model) {
  constexpr std::uint32_t most = 128;
  const std::uint32_t landmarks = format::mesh_landmarks(model.info.nodes);
  std::vector<std::uint32_t> places(std::min(most, landmarks));
  for (std::uint32_t i = 0; i < places.size(); ++i) {
    const std::uint32_t landmark = format::part_begin(i, places.size(), landmarks);
    places[i] = model.landmark_positions.empty() ? format::part_begin(landmark, landmarks, model.info.nodes)
                                                 : format::surface_landmarks(model.info.vertices) + landmark;
  }
  return places;
}

}  // namespace

[[gnu::cold]]  // compiled for size
ShapeLandmarks::ShapeLandmarks(const ModelView& model, std::size_t most_bytes)
    : model_(model), code_(kernels()), places_(chosen_places(model)), stride_(format::padded(places_.size())) {
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
