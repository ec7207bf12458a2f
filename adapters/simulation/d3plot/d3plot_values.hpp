// From the words of an element's row to the fields of a SimulationState.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "adapters/simulation/d3plot/d3plot_layout.hpp"
#include "precompute/simulation.hpp"

namespace lbea::io::d3plot {

enum class Field { plastic_strain, von_mises, thickness, internal_energy, effective_strain };

/// The fields that solids or shells store, in the order of Field.
[[nodiscard]] std::vector<Field> stored_fields(const StateLayout& layout);
[[nodiscard]] bake::SimulationField describe(Field field);

/// The field's value from one row: the maximum over points where there are several, 0 when it is not stored.
[[nodiscard]] float field_value(Field field, const RowFields& fields, std::span<const float> row);

}  // namespace lbea::io::d3plot
