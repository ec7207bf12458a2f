#include "tools/eval/mesh_series.hpp"

namespace lbea::tool {
namespace {

io::VtuGrid component(const Model& model, std::span<const float> positions, double time_s) {
  io::VtuGrid grid;
  grid.positions = positions;
  grid.element_nodes = model.element_nodes();
  grid.time_s = time_s;
  grid.point_arrays.push_back({"node_id", model.node_ids()});
  grid.cell_arrays.push_back({"element_id", model.element_ids()});
  grid.cell_arrays.push_back({"part", model.element_parts()});
  return grid;
}

}  // namespace

void MeshSeries::add_match(const std::string& number, std::uint32_t sample, double time_s) {
  io::VtuGrid grid = component(model_, model_.node_positions(sample), model_.sample_time_s(sample));
  std::vector<std::vector<float>> fields;
  for (std::uint32_t f = 0; f < model_.fields(); ++f) {
    const FieldInfo info = model_.field(f);
    auto& arrays = info.location == FieldInfo::Location::element ? grid.cell_arrays : grid.point_arrays;
    model_.read_field(f, sample, fields.emplace_back(model_.field_size(f)));
    arrays.push_back({std::string(info.name), std::span<const float>(fields.back())});
  }
  const std::vector<std::uint32_t> erosion = add_erosion({{model_.sample(sample), 1.0f}}, grid);
  matches_.push_back({time_s, folder_ / ("matched_" + number + ".vtu")});
  io::write_vtu(matches_.back().file, grid);
}

void MeshSeries::add_estimate(const std::string& number, const SurfaceFit& fit, double time_s) {
  Inferred shape;
  infer_positions(model_, fit, shape);
  std::vector<Inferred> fields(model_.fields());
  io::VtuGrid grid = component(model_, shape.mean, time_s);
  add_uncertainty("position", shape, grid.point_arrays);
  for (std::uint32_t f = 0; f < model_.fields(); ++f) {
    infer_field(model_, f, fit, fields[f]);
    const FieldInfo info = model_.field(f);
    auto& arrays = info.location == FieldInfo::Location::element ? grid.cell_arrays : grid.point_arrays;
    arrays.push_back({std::string(info.name), std::span<const float>(fields[f].mean)});
    add_uncertainty(std::string(info.name), fields[f], arrays);
  }
  const std::vector<std::uint32_t> erosion = add_erosion({fit.estimate.begin(), fit.estimate.end()}, grid);
  estimates_.push_back({time_s, folder_ / ("estimate_" + number + ".vtu")});
  io::write_vtu(estimates_.back().file, grid);
}

std::vector<std::uint32_t> MeshSeries::add_erosion(const Shape& shape, io::VtuGrid& grid) const {
  std::vector<std::uint32_t> erosion = erosion_status(present_in(model_, shape));
  if (!erosion.empty()) grid.cell_arrays.push_back({"EROSION_STATUS", std::span<const std::uint32_t>(erosion)});
  return erosion;
}

void MeshSeries::add_uncertainty(const std::string& name, const Inferred& inferred, Arrays& arrays) {
  arrays.push_back({name + "_spread", std::span<const float>(inferred.spread)});
  if (!inferred.bound_90.empty()) arrays.push_back({name + "_bound_90", std::span<const float>(inferred.bound_90)});
}

void MeshSeries::finish() const {
  io::write_pvd(folder_ / "matched.pvd", matches_);
  if (!estimates_.empty()) io::write_pvd(folder_ / "estimate.pvd", estimates_);
}

}  // namespace lbea::tool
