// The observed surface of a sample, for the coverage: all its vertices, or landmarks where the model has them.
#pragma once

#include "runtime/src/model/model_view.hpp"

namespace lbea {

class SampleSurface {
 public:
  /// Allocates all memory.
  explicit SampleSurface(const ModelView& model);

  /// Copies the sample's positions. reference: one of the model's. Does not allocate.
  void take(std::uint32_t sample, const ReferenceView& reference) noexcept;
  [[nodiscard]] std::span<const std::array<float, 3>> positions() const noexcept { return positions_; }
  /// The mass that each position represents.
  [[nodiscard]] std::span<const double> mass(const ReferenceView& reference) const noexcept;

 private:
  const ModelView& model_;
  std::vector<std::array<float, 3>> positions_;
  std::vector<std::vector<double>> landmark_mass_;  // per reference; none without landmarks
};

/// A sample's landmarks on the whole component, x 3. The model must have landmarks.
[[nodiscard]] std::span<const float> mesh_landmarks(const ModelView& model, std::uint32_t sample) noexcept;

}  // namespace lbea
