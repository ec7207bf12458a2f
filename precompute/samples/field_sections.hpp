// A model's fields, written sample by sample: as they are, or in 16 bits.
#pragma once

#include "precompute/model_file/model_writer.hpp"
#include "runtime/src/model/field_codes.hpp"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

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
  /// Per field: most that any value so far is off by.
  [[nodiscard]] const std::vector<float>& errors() const noexcept { return errors_; }

 private:
  ModelWriter& writer_;
  std::vector<FieldCode> codes_;  // of the row being written
  std::vector<float> errors_;
  bool is_compact_;
};

}  // namespace lbea::bake
