// The sections of a model that are known before the samples are read, and the sizes of those that are not.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/depth_images/view_learning.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/ensemble_description.hpp"
#include "precompute/model_file/model_writer.hpp"
#include "precompute/survey/envelope.hpp"
#include "precompute/survey/survey.hpp"

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace lbea::bake {

/// Sections with their content.
class SmallSections {
 public:
  template <typename T>
  void add(format::SectionId id, std::uint32_t part, std::vector<std::uint64_t> shape, std::span<const T> values) {
    const auto bytes = std::as_bytes(values);
    std::vector<std::byte> copy(bytes.begin(),
                                bytes.end());  // first: GCC 12 frees `shape` twice when it throws within the braces
    sections_.push_back({{id, part, element_type<T>(), std::move(shape)}, std::move(copy)});
  }
  void add_text(format::SectionId id, const std::string& text);

  void plan(std::vector<PlannedSection>& plan) const;
  void write(ModelWriter& writer) const;

 private:
  struct Section {
    PlannedSection plan;
    std::vector<std::byte> bytes;
  };
  template <typename T>
  static constexpr format::ElementType element_type() {
    if constexpr (std::is_same_v<T, char>)
      return format::ElementType::u8;
    else if constexpr (std::is_same_v<T, std::uint32_t>)
      return format::ElementType::u32;
    else if constexpr (std::is_same_v<T, float>)
      return format::ElementType::f32;
    else {
      static_assert(std::is_same_v<T, double>);
      return format::ElementType::f64;
    }
  }
  std::vector<Section> sections_;
};

/// Throws Error{bad_config} when a count does not fit 32 bits.
[[nodiscard]] format::Info model_info(const EnsembleDescription& description, const Ensemble& ensemble,
                                      const Survey& survey, const std::vector<ReferenceBasis>& references,
                                      const EnvelopeGrid& envelope);

[[nodiscard]] SmallSections small_sections(const format::Info& info, const EnsembleDescription& description,
                                           const Ensemble& ensemble, const Survey& survey,
                                           const std::vector<ReferenceBasis>& references, const EnvelopeGrid& envelope);

/// Sections written sample by sample, and those known at the end: envelope bits, provenance of `provenance_size` bytes,
/// branches, leading axes and, unless `camera` is null, depth images.
void plan_large_sections(std::vector<PlannedSection>& plan, const format::Info& info,
                         const EnsembleDescription& description, std::size_t provenance_size,
                         const DepthCamera* camera);

/// Sections 64, 65 and 67.
void write_views(ModelWriter& writer, const DepthCamera& camera, const LearntViews& learnt);

}  // namespace lbea::bake
