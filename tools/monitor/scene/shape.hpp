// A shape between samples: positions and fields, weighted.
#pragma once

#include <lbea/lbea.hpp>

#include <optional>
#include <string_view>
#include <vector>

namespace lbea::tool {

using Shape = std::vector<WeightedSample>;

/// Whether the model holds every sample of it and the weights make sense. An empty one is none.
[[nodiscard]] bool is_shape_of(const Model& model, const Shape& shape) noexcept;

/// nodes() x 3. `shape` is one of the model's.
[[nodiscard]] std::vector<float> positions_of(const Model& model, const Shape& shape);
[[nodiscard]] std::vector<float> field_of(const Model& model, const Shape& shape, std::uint32_t field);
[[nodiscard]] double time_of(const Model& model, const Shape& shape) noexcept;

/// "3:17:0.75,4:16:0.25": simulation, time step, weight. Nothing when it is not like that.
[[nodiscard]] std::optional<Shape> parse_shape(std::string_view text);

}  // namespace lbea::tool
