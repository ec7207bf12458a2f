#include "adapters/simulation/d3plot/d3plot_values.hpp"

#include <algorithm>
#include <array>
#include <cmath>

namespace lbea::io::d3plot {
namespace {

constexpr std::array all_fields{Field::plastic_strain, Field::von_mises, Field::thickness, Field::internal_energy,
                                Field::effective_strain};

bool is_stored(Field field, const RowFields& row) {
  switch (field) {
    case Field::plastic_strain:
      return row.plastic_strain.has_value();
    case Field::von_mises:
      return row.stress.has_value();
    case Field::thickness:
      return row.thickness.has_value();
    case Field::internal_energy:
      return row.internal_energy.has_value();
    case Field::effective_strain:
      return row.strain.has_value();
  }
  return false;
}

/// s : s for the deviator s of a symmetric tensor xx yy zz xy yz zx.
double deviator_squared(std::span<const float> tensor) {
  const double xx = tensor[0], yy = tensor[1], zz = tensor[2], xy = tensor[3], yz = tensor[4], zx = tensor[5];
  const double mean = (xx + yy + zz) / 3;
  return (xx - mean) * (xx - mean) + (yy - mean) * (yy - mean) + (zz - mean) * (zz - mean) +
         2 * (xy * xy + yz * yz + zx * zx);
}

template <typename Value>
float largest(std::uint64_t count, std::uint64_t start, std::uint64_t stride, Value value) {
  double most = value(start);
  for (std::uint64_t i = 1; i < count; ++i) most = std::max(most, value(start + i * stride));
  return static_cast<float>(most);
}

}  // namespace

std::vector<Field> stored_fields(const StateLayout& layout) {
  std::vector<Field> stored;
  for (const Field field : all_fields)
    if ((layout.solids.rows > 0 && is_stored(field, layout.solid)) ||
        (layout.shells.rows > 0 && is_stored(field, layout.shell)))
      stored.push_back(field);
  return stored;
}

bake::SimulationField describe(Field field) {
  switch (field) {
    case Field::plastic_strain:
      return {"plastic_strain", "1"};
    case Field::von_mises:
      return {"von_mises", ""};
    case Field::thickness:
      return {"thickness", ""};
    case Field::internal_energy:
      return {"internal_energy", ""};
    case Field::effective_strain:
      return {"effective_strain", "1"};
  }
  return {};
}

float field_value(Field field, const RowFields& fields, std::span<const float> row) {
  if (!is_stored(field, fields)) return 0;
  const auto tensor = [&](std::uint64_t at) { return deviator_squared(row.subspan(at, 6)); };
  switch (field) {
    case Field::plastic_strain:
      return largest(fields.points, *fields.plastic_strain, fields.point_words,
                     [&](std::uint64_t at) { return static_cast<double>(row[at]); });
    case Field::von_mises:  // sqrt(3/2 s:s)
      return largest(fields.points, *fields.stress, fields.point_words,
                     [&](std::uint64_t at) { return std::sqrt(1.5 * tensor(at)); });
    case Field::effective_strain:  // sqrt(2/3 e:e), e the deviator
      return largest(fields.strains, *fields.strain, fields.strain_stride,
                     [&](std::uint64_t at) { return std::sqrt(2.0 / 3.0 * tensor(at)); });
    case Field::thickness:
      return row[*fields.thickness];
    case Field::internal_energy:
      return row[*fields.internal_energy];
  }
  return 0;
}

}  // namespace lbea::io::d3plot
