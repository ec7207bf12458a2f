#include "tools/monitor/scene/model_exports.hpp"

#include "adapters/export/vtu.hpp"
#include "adapters/files/atomic_file.hpp"
#include "tools/monitor/scene/packet.hpp"
#include "tools/monitor/scene/scene.hpp"
#include "tools/shared/system/scratch_folder.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool {
namespace {

constexpr std::uint32_t most_ranged_samples = 400;
constexpr std::size_t most_range_values = 1'000'000;  // per field
constexpr std::uint32_t most_curve_points = 20'000;

template <class Visit>
void for_picked_samples(const Model& model, std::uint32_t most, Visit visit) {
  const std::uint32_t picked = std::min(most, model.samples());
  for (std::uint32_t i = 0; i < picked; ++i)
    visit(static_cast<std::uint32_t>(std::uint64_t{i} * model.samples() / picked));
}

/// From the minimum to the 99th percentile: a few folded elements must not use up the color scale.
ColorRange range_of(std::vector<float>& values) {
  if (values.empty()) return {};
  const float least = *std::ranges::min_element(values), most = *std::ranges::max_element(values);
  const auto high = values.begin() + static_cast<std::ptrdiff_t>((values.size() - 1) * 99 / 100);
  std::ranges::nth_element(values, high);
  return {least, *high > least ? *high : most};
}

void append_some(std::vector<float>& values, std::span<const float> more, std::size_t every) {
  for (std::size_t i = 0; i < more.size(); i += every)
    if (std::isfinite(more[i])) values.push_back(more[i]);
}

std::vector<float> curves_of(const Model& model) {
  std::vector<float> curves;
  for_picked_samples(model, most_curve_points, [&](std::uint32_t sample) {
    const auto at = model.leading_coordinates(0, sample);
    curves.insert(curves.end(), {static_cast<float>(model.sample(sample).simulation),
                                 static_cast<float>(model.sample_time_s(sample)), at[0], at[1], at[2]});
  });
  return curves;
}

nlohmann::json simulations_of(const Model& model) {
  nlohmann::json simulations = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.simulations(); ++i) {
    nlohmann::json parameters = nlohmann::json::array();
    for (std::uint32_t k = 0; k < model.parameters(); ++k)
      parameters.push_back(model.parameter(i, k));  // NaN becomes null
    simulations.push_back(
        {{"name", model.simulation_name(i)}, {"branch", model.branch_of(i)}, {"parameters", parameters}});
  }
  return simulations;
}

nlohmann::json fields_of(const Model& model, const ModelRanges& ranges) {
  nlohmann::json fields = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.fields(); ++i) {
    const FieldInfo info = model.field(i);
    fields.push_back({{"name", info.name},
                      {"unit", info.unit},
                      {"location", info.location == FieldInfo::Location::node ? "node" : "element"},
                      {"lo", ranges.fields[i].lo},
                      {"hi", ranges.fields[i].hi}});
  }
  return fields;
}

nlohmann::json channels_of(const Model& model) {
  nlohmann::json channels = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.channels(); ++i)
    channels.push_back({{"name", model.channel(i).name}, {"unit", model.channel(i).unit}});
  return channels;
}

http::Response mesh_file(const Model& model, const Shape& shape, const std::string& file_prefix) {
  const auto positions = positions_of(model, shape);
  io::VtuGrid grid{positions, model.element_nodes(), {}, {}, time_of(model, shape)};
  std::vector<std::vector<float>> fields;
  for (std::uint32_t i = 0; i < model.fields(); ++i) fields.push_back(field_of(model, shape, i));
  grid.point_arrays.push_back({"node_id", model.node_ids(), 1});
  grid.cell_arrays.push_back({"element_id", model.element_ids(), 1});
  grid.cell_arrays.push_back({"part_id", model.element_parts(), 1});
  const std::vector<std::uint32_t> erosion = erosion_status(present_in(model, shape));
  if (!erosion.empty()) grid.cell_arrays.push_back({"EROSION_STATUS", std::span<const std::uint32_t>(erosion), 1});
  for (std::uint32_t i = 0; i < model.fields(); ++i) {
    const FieldInfo info = model.field(i);
    auto& arrays = info.location == FieldInfo::Location::node ? grid.point_arrays : grid.cell_arrays;
    arrays.push_back({std::string(info.name), std::span<const float>(fields[i]), 1});
  }
  const ScratchFolder scratch;
  io::write_vtu(scratch.path() / "mesh.vtu", grid);
  const auto bytes = io::read_file(scratch.path() / "mesh.vtu");
  return file_response("application/octet-stream", std::string(io::as_text(bytes)), file_prefix + "mesh.vtu");
}

}  // namespace

ModelRanges ranges_of(const Model& model) {
  constexpr float infinity = std::numeric_limits<float>::infinity();
  ModelRanges ranges;
  ranges.lo.fill(infinity);
  ranges.hi.fill(-infinity);
  std::vector<std::vector<float>> values(model.fields());
  const std::size_t picked = std::min(most_ranged_samples, model.samples());
  for_picked_samples(model, most_ranged_samples, [&](std::uint32_t sample) {
    const auto positions = model.node_positions(sample);
    for (std::size_t i = 0; i < positions.size(); ++i) {
      ranges.lo[i % 3] = std::min(ranges.lo[i % 3], positions[i]);
      ranges.hi[i % 3] = std::max(ranges.hi[i % 3], positions[i]);
    }
    for (std::uint32_t field = 0; field < model.fields(); ++field) {
      std::vector<float> field_values(model.field_size(field));
      model.read_field(field, sample, field_values);
      append_some(values[field], field_values, 1 + field_values.size() * picked / most_range_values);
    }
  });
  for (std::vector<float>& field_values : values) ranges.fields.push_back(range_of(field_values));
  return ranges;
}

std::string model_packet(const Model& model, const ModelRanges& ranges, const nlohmann::json& recording) {
  nlohmann::json parameters = nlohmann::json::array();
  for (std::uint32_t i = 0; i < model.parameters(); ++i) parameters.push_back(model.parameter_name(i));
  const nlohmann::json head{{"type", "model"},
                            {"unit", model.length_unit()},
                            {"simulations", simulations_of(model)},
                            {"parameters", parameters},
                            {"fields", fields_of(model, ranges)},
                            {"channels", channels_of(model)},
                            {"lo", ranges.lo},
                            {"hi", ranges.hi},
                            {"nodes", model.nodes()},
                            {"samples", model.samples()},
                            {"axes", model.leading_axes(0)},
                            {"branches", model.branches()},
                            {"references", model.references()},
                            {"recording", recording}};
  Packet packet;
  const auto elements = model.element_nodes();
  packet.add("elements", std::vector<std::uint32_t>(elements.begin(), elements.end()));
  packet.add("curves", curves_of(model));
  return packet.finish(head);
}

http::Response mesh_response(const Model& model, std::string_view text, const std::string& file_prefix) {
  const auto shape = parse_shape(text);
  if (!shape || !is_shape_of(model, *shape))
    return text_response(400, "shape= needs samples of this model with weights, e.g. 3:17:0.75,4:16:0.25");
  return mesh_file(model, *shape, file_prefix);
}

}  // namespace lbea::tool
