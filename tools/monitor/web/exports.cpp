#include "tools/monitor/web/exports.hpp"

#include "adapters/export/vtu.hpp"
#include "adapters/files/atomic_file.hpp"
#include "tools/monitor/web/access.hpp"
#include "tools/shared/cli/scratch_folder.hpp"

#include <nlohmann/json.hpp>

namespace lbea::tool {
namespace {

HttpAnswer refusal(unsigned status, std::string sentence) {
  return {status, "text/plain; charset=utf-8", std::move(sentence), ""};
}

}  // namespace

ModelExports::ModelExports(const Model& model, const ModelRanges& ranges)
    : model_(model), names_(lbea::tool::simulation_names(model)), packet_(model_packet(model, ranges, nullptr)) {}

std::optional<HttpAnswer> ModelExports::answer(std::string_view target) const {
  const std::string_view path = target.substr(0, target.find('?'));
  if (path == "/api/model") return HttpAnswer{200, "application/octet-stream", packet_, ""};
  if (path != "/export/mesh.vtu") return {};
  const auto shape = parse_shape(query_value(target, "shape"));
  if (!shape || !is_shape_of(model_, *shape))
    return refusal(400, "shape= wants samples of this model with weights, e.g. 3:17:0.75,4:16:0.25");
  return mesh(*shape);
}

HttpAnswer ModelExports::mesh(const Shape& shape) const {
  const auto positions = positions_of(model_, shape);
  io::VtuGrid grid{positions, model_.element_nodes(), {}, {}, time_of(model_, shape)};
  std::vector<std::vector<float>> fields;
  for (std::uint32_t i = 0; i < model_.fields(); ++i) fields.push_back(field_of(model_, shape, i));
  grid.point_arrays.push_back({"node_id", model_.node_ids(), 1});
  grid.cell_arrays.push_back({"element_id", model_.element_ids(), 1});
  grid.cell_arrays.push_back({"part_id", model_.element_parts(), 1});
  for (std::uint32_t i = 0; i < model_.fields(); ++i) {
    const FieldInfo info = model_.field(i);
    auto& arrays = info.location == FieldInfo::Location::node ? grid.point_arrays : grid.cell_arrays;
    arrays.push_back({std::string(info.name), std::span<const float>(fields[i]), 1});
  }
  const ScratchFolder scratch;
  io::write_vtu(scratch.path() / "mesh.vtu", grid);
  const auto bytes = io::read_file(scratch.path() / "mesh.vtu");
  return {200, "application/octet-stream", std::string(io::as_text(bytes)), "mesh.vtu"};
}

}  // namespace lbea::tool
