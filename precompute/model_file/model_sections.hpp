// The sections of a model: the content of those that are known before the samples are read, and the sizes of the
// others.
#pragma once

#include "precompute/depth_images/residuals.hpp"
#include "precompute/model_file/model_writer.hpp"
#include "precompute/survey/envelope.hpp"
#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {

/// Sections with their content.
class SmallSections {
 public:
  template <typename T>
  void add(format::SectionId id, std::uint32_t part, std::vector<std::uint64_t> shape, std::span<const T> values) {
    const auto bytes = std::as_bytes(values);
    // A separate statement: GCC 12 frees `shape` twice when the copy throws within the braces.
    std::vector<std::byte> copy(bytes.begin(), bytes.end());
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

/// All sections of the model that the plan's runs make, before any of them is written.
struct ModelPlan {
  format::Info info{};
  SmallSections small;
  std::size_t provenance_size = 0;
  std::vector<PlannedSection> sections;
};

/// left_out: names of the runs that the plan no longer has, for the provenance.
/// Throws Error{bad_config} when a count does not fit 32 bits.
[[nodiscard]] ModelPlan plan_model(const BakePlan& plan, const std::vector<ReferenceBasis>& bases,
                                   const EnvelopeGrid& envelope, const std::vector<std::string>& left_out);

/// How the model was made, as JSON. Depends only on the inputs: no paths, times of day, machines or numbers of threads.
/// kept_variance: NaN becomes null. left_out: names of runs that could not be read; the key is absent when there are
/// none.
[[nodiscard]] std::string provenance_json(const BakePlan& plan, const std::vector<ReferenceBasis>& references,
                                          double kept_variance, const std::vector<std::string>& left_out);

/// Sections 64, 65 and 67: camera, size and expected residuals; the images are written sample by sample.
void write_residuals(ModelWriter& writer, const DepthCamera& camera, const LearnedResiduals& learned);

}  // namespace lbea::bake
