#include "precompute/samples/landmarks.hpp"

#include <algorithm>

namespace lbea::bake {
namespace {

constexpr std::uint64_t most_without_landmarks = std::uint64_t{1} << 30;  // bytes of positions

}  // namespace

bool has_landmarks(const format::Info& info, const EnsembleDescription& description) noexcept {
  return description.landmarks.value_or(std::uint64_t{info.samples} * info.nodes >
                                        most_without_landmarks / (3 * sizeof(float)));
}

void plan_landmarks(std::vector<PlannedSection>& plan, const format::Info& info) {
  const std::uint64_t landmarks =
      std::uint64_t{format::surface_landmarks(info.vertices)} + format::mesh_landmarks(info.nodes);
  plan.push_back({format::SectionId::landmark_positions, 0, format::ElementType::f32, {info.samples, landmarks, 3}});
}

LandmarkSection::LandmarkSection(ModelWriter& writer, const format::Info& info, const ReferenceBasis& first)
    : writer_(writer) {
  const std::uint32_t surface = format::surface_landmarks(info.vertices), mesh = format::mesh_landmarks(info.nodes);
  for (std::uint32_t k = 0; k < surface; ++k)
    nodes_.push_back(first.vertex_nodes[format::landmark_vertex(k, surface, info.vertices)]);
  for (std::uint32_t k = 0; k < mesh; ++k) nodes_.push_back(format::part_begin(k, mesh, info.nodes));
  row_.resize(3 * nodes_.size());
}

void LandmarkSection::write(std::uint64_t sample, std::span<const float> positions) {
  for (std::size_t i = 0; i < nodes_.size(); ++i) std::copy_n(&positions[std::size_t{3} * nodes_[i]], 3, &row_[3 * i]);
  writer_.write<float>(format::SectionId::landmark_positions, 0, sample * row_.size(), row_);
}

}  // namespace lbea::bake
