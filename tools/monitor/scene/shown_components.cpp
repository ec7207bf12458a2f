#include "tools/monitor/scene/shown_components.hpp"

#include "tools/monitor/scene/packet.hpp"
#include "tools/shared/answer/component_results.hpp"
#include "tools/shared/text/formatted.hpp"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cctype>

namespace lbea::tool {
ShownComponents::Component::Component(const NamedModel& named)
    : name(named.name),
      model(named.model),
      ranges(ranges_of(model)),
      simulations(tool::simulation_names(model)),
      scenes(model, ranges) {}

ShownComponents::ShownComponents(const std::vector<NamedModel>& models) {
  for (const NamedModel& named : models) components_.emplace_back(named);
  box_ = components_.front().scenes.box();
  for (const Component& component : components_)
    for (std::size_t k = 0; k < 3; ++k) {
      box_.lo[k] = std::min(box_.lo[k], component.scenes.box().lo[k]);
      box_.hi[k] = std::max(box_.hi[k], component.scenes.box().hi[k]);
    }
}

std::vector<std::size_t> ShownComponents::concerned(const wire::WireResult& result) const {
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < size(); ++i)
    if (concerns(result, model(i).checksum())) numbers.push_back(i);
  return numbers;
}

std::string ShownComponents::description(const nlohmann::json& recording) const {
  if (size() == 1) return model_packet(components_.front().model, components_.front().ranges, recording);
  std::vector<std::string> models, names;
  for (const Component& component : components_) {
    models.push_back(model_packet(component.model, component.ranges, nullptr));
    names.push_back(component.name);
  }
  Packet packet;
  packet.add_components(models);
  return packet.finish({{"type", "models"}, {"components", names}, {"recording", recording}});
}

std::optional<std::size_t> ShownComponents::component_in(std::string_view target) const {
  const std::string_view text = http::query_value(target, "component");
  if (text.empty()) return 0;
  const auto number = parsed<std::size_t>(text);
  return number && *number < size() ? number : std::nullopt;
}

std::optional<http::Response> ShownComponents::respond(std::string_view target) const {
  const std::string_view path = target.substr(0, target.find('?'));
  const auto component = component_in(target);
  if (!component && (path.starts_with("/export/") || path.starts_with("/api/")))
    return text_response(404, "component= needs one of the components, counted from 0");
  if (path != "/export/mesh.vtu") return {};
  return mesh_response(model(*component), http::query_value(target, "shape"), file_prefix(*component));
}

std::string ShownComponents::file_prefix(std::size_t component) const {
  if (size() == 1) return "";
  std::string prefix = components_[component].name + "-";
  const auto is_plain = [](unsigned char c) { return std::isalnum(c) != 0 || c == '-' || c == '_' || c == '.'; };
  std::ranges::replace_if(
      prefix, [&](char c) { return !is_plain(static_cast<unsigned char>(c)); }, '_');
  return prefix;
}

std::string ShownComponents::build(const AssembledMoment& moment, nlohmann::json head,
                                   std::vector<nlohmann::json> heads) const {
  if (size() == 1) {
    head.update(heads.front());
    return components_.front().scenes.build({moment.results.front(), moment.cloud}, std::move(head));
  }
  std::vector<std::string> scenes;
  std::vector<std::optional<bake::SurfaceTree>> surfaces(size());
  for (std::size_t i = 0; i < size(); ++i)
    scenes.push_back(components_[i].scenes.build_meshes(moment.results[i], std::move(heads[i]), surfaces[i]));
  Packet packet;
  packet.add_components(scenes);
  const auto shown = std::ranges::max_element(moment.results, {}, &wire::WireResult::frame_id);
  head["type"] = "components";
  head["scene"] = json_of(box_);
  head["scene"]["frame"] = shown->frame_id;
  if (moment.cloud != nullptr) head["scene"]["cloud"] = add_cloud(*moment.cloud, box_, surfaces, packet);
  return packet.finish(std::move(head));
}

}  // namespace lbea::tool
