// The layout of one state, in words from its start, and the fields read from it.
#pragma once

#include "adapters/simulation/d3plot/geometry.hpp"
#include "precompute/simulation.hpp"

namespace lbea::io::d3plot {

/// The contents of one element's row. Points are through-thickness layers or integration points.
struct RowFields {
  std::uint64_t points = 0, point_words = 0;
  std::optional<std::uint64_t> stress;          // in each point: xx yy zz xy yz zx
  std::optional<std::uint64_t> plastic_strain;  // in each point
  std::optional<std::uint64_t> thickness, internal_energy;
  std::optional<std::uint64_t> strain;  // first of `strains` tensors, `strain_stride` apart
  std::uint64_t strains = 0, strain_stride = 0;
};

struct Block {
  std::uint64_t start = 0, rows = 0, row_words = 0;
};

struct StateLayout {
  std::uint64_t words = 0;  // of one state
  std::uint64_t positions = 0;
  Block solids, shells;
  RowFields solid, shell;
  // first words of the deletion flags: one per node or one per element
  std::uint64_t node_flags = 0, solid_flags = 0, shell_flags = 0;
};

/// Throws Error{bad_input} when the control words contradict each other.
[[nodiscard]] StateLayout lay_out_state(const WordFile& file, const Header& header, const Geometry& geometry);

enum class Field { plastic_strain, von_mises, thickness, internal_energy, effective_strain };

/// The fields that solids or shells store, in the order of Field.
[[nodiscard]] std::vector<Field> stored_fields(const StateLayout& layout);
[[nodiscard]] bake::SimulationField describe(Field field);

/// The field's value from one row: the maximum over its points; 0 when it is not stored.
[[nodiscard]] float field_value(Field field, const RowFields& fields, std::span<const float> row);

}  // namespace lbea::io::d3plot
