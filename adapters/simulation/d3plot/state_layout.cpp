#include "adapters/simulation/d3plot/database.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::io::d3plot {
namespace {
// Per point: stress, plastic strain, history. Its last six history values are the strain when strains are stored.
RowFields solid_fields(const Header& header) {
  const std::uint64_t stress = header.has_solid_stress ? 6 : 0, plastic = header.has_solid_plastic_strain ? 1 : 0;
  const std::uint64_t point = stress + plastic + header.solid_history;
  RowFields row;
  row.points = point > 0 && header.solid_words / point >= 8 ? 8 : 1;
  row.point_words = header.solid_words / row.points;
  if (stress > 0 && stress <= row.point_words) row.stress = 0;
  if (plastic > 0 && stress + plastic <= row.point_words) row.plastic_strain = stress;
  if (header.has_strain && header.solid_history >= 6 && point <= row.point_words) {
    row.strain = point - 6;
    row.strains = row.points;
    row.strain_stride = row.point_words;
  }
  return row;
}

// Layers of stress, plastic strain, history; then forces, thickness and two more, strain of both surfaces, energy.
RowFields shell_fields(const WordFile& file, const Header& header) {
  RowFields row;
  if (header.shell_words == 0) return row;
  const std::uint64_t stress = header.has_shell_stress ? 6 : 0, plastic = header.has_shell_plastic_strain ? 1 : 0;
  row.points = header.shell_points;
  row.point_words = stress + plastic + header.shell_history;
  if (row.point_words == 0) row.points = 0;
  std::uint64_t at = times(row.points, row.point_words);
  if (at > header.shell_words)
    file.refuse(Status::bad_input, 33,
                "a shell's row has " + std::to_string(header.shell_words) + " words (NV2D), its layers need " +
                    std::to_string(at) + "; the control words are damaged, copy or compute the file again");
  if (row.points > 0 && stress > 0) row.stress = 0;
  if (row.points > 0 && plastic > 0) row.plastic_strain = stress;
  if (header.has_shell_forces) at += 8;
  if (header.has_shell_extra) {
    row.thickness = at;
    at += 3;
  }
  if (header.has_strain && at + 12 <= header.shell_words) {
    row.strain = at;
    row.strains = 2;
    row.strain_stride = 6;
    at += 12;
  }
  if (header.has_shell_extra) row.internal_energy = at;
  if (row.thickness && *row.thickness >= header.shell_words) row.thickness.reset();
  if (row.internal_energy && *row.internal_energy >= header.shell_words) row.internal_energy.reset();
  return row;
}

// Layers of stress, plastic strain, history; then strain of both surfaces. A row that is too short for its layers, as
// in databases without thick shells, has no fields.
RowFields thick_shell_fields(const Header& header) {
  const std::uint64_t stress = header.has_shell_stress ? 6 : 0, plastic = header.has_shell_plastic_strain ? 1 : 0;
  RowFields row;
  row.points = header.shell_points;
  row.point_words = stress + plastic + header.shell_history;
  const std::uint64_t layers = times(row.points, row.point_words);
  if (layers == 0 || layers > header.thick_shell_words) return {};
  if (stress > 0) row.stress = 0;
  if (plastic > 0) row.plastic_strain = stress;
  if (header.has_strain && layers + 12 <= header.thick_shell_words) {
    row.strain = layers;
    row.strains = 2;
    row.strain_stride = 6;
  }
  return row;
}

/// Allocates the blocks of a state one after the other.
class Blocks {
 public:
  std::uint64_t next(std::uint64_t rows, std::uint64_t row_words) {
    const std::uint64_t start = end_;
    end_ = plus(end_, times(rows, row_words));
    return start;
  }
  std::uint64_t end() const { return end_; }

 private:
  std::uint64_t end_ = 0;
};

struct FieldName {
  Field field;
  const char *name, *unit, *source;
};
constexpr auto largest_of_points = "largest of the integration points";
constexpr std::array field_names{
    FieldName{Field::plastic_strain, "plastic_strain", "1", largest_of_points},
    FieldName{Field::von_mises, "von_mises", "", largest_of_points}, FieldName{Field::thickness, "thickness", "", ""},
    FieldName{Field::internal_energy, "internal_energy", "", "per volume"},
    FieldName{Field::effective_strain, "effective_strain", "1", "larger of the two surfaces"}};

/// The first word of the field in a row; nothing when it is not stored.
std::optional<std::uint64_t> start_of(Field field, const RowFields& row) {
  switch (field) {
    case Field::plastic_strain:
      return row.plastic_strain;
    case Field::von_mises:
      return row.stress;
    case Field::thickness:
      return row.thickness;
    case Field::internal_energy:
      return row.internal_energy;
    case Field::effective_strain:
      return row.strain;
  }
  return std::nullopt;
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

StateLayout lay_out_state(const WordFile& file, const Header& header, const Geometry& geometry) {
  const std::uint64_t shell_rows = header.shells - (header.stores_rigid_shells ? 0 : geometry.rigid_shells);
  StateLayout layout;
  layout.solid = solid_fields(header);
  layout.shell = shell_fields(file, header);
  layout.thick_shell = thick_shell_fields(header);
  Blocks blocks;
  blocks.next(1, 1);  // time
  blocks.next(1, header.globals);
  layout.positions = blocks.next(header.nodes, header.node_words);
  blocks.next(header.solids, header.solid_thermal_words);
  layout.solids = {blocks.next(header.solids, header.solid_words), header.solids, header.solid_words};
  layout.thick_shells = {blocks.next(header.thick_shells, header.thick_shell_words), header.thick_shells,
                         header.thick_shell_words};
  blocks.next(header.beams, header.beam_words);
  layout.shells = {blocks.next(shell_rows, header.shell_words), shell_rows, header.shell_words};
  if (header.deletion == Deletion::nodes) layout.node_flags = blocks.next(header.nodes, 1);
  if (header.deletion == Deletion::elements) {
    layout.solid_flags = blocks.next(header.solids, 1);
    blocks.next(header.thick_shells, 1);
    layout.shell_flags = blocks.next(header.shells, 1);
    blocks.next(header.beams, 1);
  }
  blocks.next(geometry.moving_roads, 6);
  layout.words = blocks.end();
  return layout;
}

std::vector<Field> stored_fields(const StateLayout& layout) {
  std::vector<Field> stored;
  for (const FieldName& known : field_names)
    if ((layout.solids.rows > 0 && start_of(known.field, layout.solid)) ||
        (layout.thick_shells.rows > 0 && start_of(known.field, layout.thick_shell)) ||
        (layout.shells.rows > 0 && start_of(known.field, layout.shell)))
      stored.push_back(known.field);
  return stored;
}

bake::SimulationField describe(Field field) {
  const FieldName& known = field_names[static_cast<std::size_t>(field)];
  return {known.name, known.unit, known.source};
}

float field_value(Field field, const RowFields& fields, std::span<const float> row) {
  const auto start = start_of(field, fields);
  if (!start) return 0;
  const auto tensor = [&](std::uint64_t at) { return deviator_squared(row.subspan(at, 6)); };
  switch (field) {
    case Field::plastic_strain:
      return largest(fields.points, *start, fields.point_words,
                     [&](std::uint64_t at) { return static_cast<double>(row[at]); });
    case Field::von_mises:  // sqrt(3/2 s:s)
      return largest(fields.points, *start, fields.point_words,
                     [&](std::uint64_t at) { return std::sqrt(1.5 * tensor(at)); });
    case Field::effective_strain:  // sqrt(2/3 e:e), e the deviator
      return largest(fields.strains, *start, fields.strain_stride,
                     [&](std::uint64_t at) { return std::sqrt(2.0 / 3.0 * tensor(at)); });
    case Field::thickness:
    case Field::internal_energy:
      return row[*start];
  }
  return 0;
}
}  // namespace lbea::io::d3plot
