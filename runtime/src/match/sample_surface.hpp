// The observed surface of a sample, to be held against a frame: all its vertices, or landmarks where the model has
// them.
#pragma once

#include "runtime/src/model/model_view.hpp"

#include <array>
#include <cstdint>
#include <span>
#include <vector>

namespace lbea {

class SampleSurface {
 public:
  /// All memory is allocated here.
  explicit SampleSurface(const ModelView& model);

  /// reference: one of the model's. No allocation.
  void take(std::uint32_t sample, const ReferenceView& reference) noexcept;
  [[nodiscard]] std::span<const std::array<float, 3>> positions() const noexcept { return positions_; }
  /// Of what each position stands for.
  [[nodiscard]] std::span<const double> mass(const ReferenceView& reference) const noexcept;

 private:
  const ModelView& model_;
  std::vector<std::array<float, 3>> positions_;
  std::vector<std::vector<double>> landmark_mass_;  // per reference; none without landmarks
};

/// A sample's landmarks all over the component, x 3. The model has landmarks.
[[nodiscard]] std::span<const float> mesh_landmarks(const ModelView& model, std::uint32_t sample) noexcept;

}  // namespace lbea
