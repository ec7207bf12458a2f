#include "precompute/samples/field_sections.hpp"

#include <algorithm>
#include <array>

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

}  // namespace lbea::bake
