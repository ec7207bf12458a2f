#include "precompute/model_file/sample_sections.hpp"

namespace lbea::bake {

using format::ElementType;
using format::SectionId;

void plan_field(std::vector<PlannedSection>& plan, const format::Info& info, std::uint32_t field, bool is_compact) {
  if (!is_compact) {
    plan.push_back({SectionId::field_values, field, ElementType::f32, {info.samples, info.elements}});
    return;
  }
  plan.push_back({SectionId::field_codes, field, ElementType::u16, {info.samples, info.elements}});
  plan.push_back({SectionId::field_ranges, field, ElementType::f32, {info.samples, 3}});
}

void FieldSections::write(std::uint32_t field, std::uint64_t sample, std::span<const float> values) {
  if (!is_compact_) return writer_.write<float>(SectionId::field_values, field, sample * values.size(), values);
  const FieldRange range = range_of_field(values);
  codes_.resize(values.size());
  std::ranges::transform(values, codes_.begin(), [&](float value) { return encoded(value, range); });
  const std::array<float, 3> words{range.low, range.high, largest_error(range)};
  writer_.write<FieldCode>(SectionId::field_codes, field, sample * codes_.size(), codes_);
  writer_.write<float>(SectionId::field_ranges, field, sample * words.size(), words);
  errors_[field] = std::max(errors_[field], words.back());
}

bool has_landmarks(const format::Info& info, const EnsembleDescription& description) noexcept {
  constexpr std::uint64_t most_without_landmarks = std::uint64_t{1} << 30;  // bytes of positions
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
