// Shapes of the component as combinations of samples, for pictures.
#pragma once

#include "adapters/wire/codec/messages.hpp"

namespace lbea::tool {

/// A weighted mean of samples.
using Shape = std::vector<WeightedSample>;

/// Whether `shape` has at least one sample and not too many, the model has all of them, and every weight is possible.
[[nodiscard]] bool is_shape_of(const Model& model, const Shape& shape) noexcept;
/// nodes() x 3. `shape` must be a shape of the model.
[[nodiscard]] std::vector<float> positions_of(const Model& model, const Shape& shape);
[[nodiscard]] std::vector<float> field_of(const Model& model, const Shape& shape, std::uint32_t field);
[[nodiscard]] double time_of(const Model& model, const Shape& shape) noexcept;

/// The shapes that a result names, which need not be shapes of a model.
struct Leaders {
  Shape estimate;  // of method fit; otherwise the best sample
  Shape match;     // the best sample
  Shape ghost;     // the best sample of another simulation
};
[[nodiscard]] Leaders leaders_of(const wire::WireResult& result);

/// The node positions at the end of the test, nodes() x 3, that a result forecasts; empty: no forecast of the model.
[[nodiscard]] std::vector<float> final_positions_of(const Model& model, const wire::WireForecast& forecast);

/// Per element 1, or 0 where samples with at least half of the weight have lost it; empty when no sample lacks
/// elements.
[[nodiscard]] std::vector<std::uint8_t> present_in(const Model& model, const Shape& shape);

/// The elements that are not present.
[[nodiscard]] std::vector<std::uint32_t> eroded_in(const Model& model, const Shape& shape);

/// The same as the array EROSION_STATUS of mesh files.
[[nodiscard]] inline std::vector<std::uint32_t> erosion_status(const std::vector<std::uint8_t>& present) {
  return {present.begin(), present.end()};
}

/// The corners of the component's elements; a triangle repeats its last node.
[[nodiscard]] std::vector<std::array<std::uint32_t, 4>> elements_of(const Model& model);

/// The same; the corners of eroded elements fall together, so that they have no area.
[[nodiscard]] std::vector<std::array<std::uint32_t, 4>> without_eroded(
    std::vector<std::array<std::uint32_t, 4>> elements, std::span<const std::uint32_t> eroded);

inline constexpr std::size_t most_samples_of_shape = 256;

}  // namespace lbea::tool
