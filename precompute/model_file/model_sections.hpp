// The sections of a model: the content of those that are known before the samples are read, and the sizes of the
// others.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/depth_images/learned_fit.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/forecast/forecast_training.hpp"
#include "precompute/model_file/model_writer.hpp"
#include "precompute/survey/envelope.hpp"
#include "precompute/work/bake_plan.hpp"
#include "runtime/src/model/field_codes.hpp"

namespace lbea::bake {

/// Sections `field_values`, or `field_codes` and `field_ranges`.
void plan_field(std::vector<PlannedSection>& plan, const format::Info& info, std::uint32_t field, bool is_compact);

class FieldSections {
 public:
  /// Keeps a reference to the writer.
  FieldSections(ModelWriter& writer, std::size_t fields, bool is_compact)
      : writer_(writer), errors_(fields), is_compact_(is_compact) {}

  /// One value per element of one sample. NaN and infinities are kept in either form.
  void write(std::uint32_t field, std::uint64_t sample, std::span<const float> values);
  /// Those of a sample that was written before, from any thread.
  void read(std::uint32_t field, std::uint64_t sample, std::span<float> values) const;
  /// Per field: largest rounding error so far.
  [[nodiscard]] const std::vector<float>& errors() const noexcept { return errors_; }

 private:
  ModelWriter& writer_;
  std::vector<FieldCode> codes_;  // of the row being written
  std::vector<float> errors_;
  bool is_compact_;
};

/// Positions that matching needs, stored separately for models whose positions exceed the memory. As the description
/// says; if it does not, models whose positions take more than 1 GiB have landmarks.
[[nodiscard]] bool has_landmarks(const format::Info& info, const EnsembleDescription& description) noexcept;
void plan_landmarks(std::vector<PlannedSection>& plan, const format::Info& info);

class LandmarkSection {
 public:
  /// Keeps a reference to the writer. info: of a model with landmarks; first: its first reference.
  LandmarkSection(ModelWriter& writer, const format::Info& info, const ReferenceBasis& first);

  /// positions: N x 3, of a sample.
  void write(std::uint64_t sample, std::span<const float> positions);

 private:
  ModelWriter& writer_;
  std::vector<std::uint32_t> nodes_;
  std::vector<float> row_;
};

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

/// Sections 64, 65, 0x8001 to 0x800B and 0x8011 to 0x8014: camera and metric, size, and what was learned; the images
/// are written sample by sample. part: of the rig.
void write_learned_fit(ModelWriter& writer, const DepthCamera& camera, const LearnedFit& learned, std::uint32_t part);
/// Section 0x8023.
void write_channel_bounds(ModelWriter& writer, const LearnedFit& learned);
/// Sections 0x8018 to 0x801D; with channels also 0x8024 and 0x8025.
void write_forecast(ModelWriter& writer, const TrainedForecast& forecast);

}  // namespace lbea::bake
