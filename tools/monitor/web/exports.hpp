// What can be fetched of the model: its description for the page, meshes for ParaView.
#pragma once

#include "tools/monitor/feeds/feed.hpp"
#include "tools/monitor/scene/model_pages.hpp"
#include "tools/monitor/scene/shape.hpp"

namespace lbea::tool {

class ModelExports {
 public:
  ModelExports(const Model& model, const ModelRanges& ranges);
  /// "/api/model", "/export/mesh.vtu?shape=3:17:0.75,4:16:0.25".
  [[nodiscard]] std::optional<HttpAnswer> answer(std::string_view target) const;
  [[nodiscard]] std::span<const std::string> simulation_names() const noexcept { return names_; }

 private:
  [[nodiscard]] HttpAnswer mesh(const Shape& shape) const;
  Model model_;
  std::vector<std::string> names_;
  std::string packet_;
};

}  // namespace lbea::tool
