// What matching needs of the samples' positions, apart from them: of models that memory may not hold.
#pragma once

#include "precompute/basis/reference_basis.hpp"
#include "precompute/ensemble_description.hpp"
#include "precompute/model_file/model_writer.hpp"

#include <cstdint>
#include <span>
#include <vector>

namespace lbea::bake {

/// The description's wish; without one, models whose positions take more than 1 GiB have landmarks.
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
