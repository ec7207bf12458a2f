// Sections of a model that are written sample by sample: fields, as they are or in 16 bits, and landmarks.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/ensemble.hpp"
#include "precompute/model_file/model_writer.hpp"
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

}  // namespace lbea::bake
