// The components that the page shows together, each with its own model.
#pragma once

#include "tools/monitor/scene/scene.hpp"
#include "tools/shared/matching/named_models.hpp"

#include <deque>

namespace lbea::tool {

/// What is shown of a frame: the result of each component, and its cloud in reference coordinates.
struct AssembledMoment {
  std::vector<wire::WireResult> results;
  std::shared_ptr<const std::vector<Point>> cloud{};  // null: none
};

class ShownComponents {
 public:
  /// At least one.
  explicit ShownComponents(const std::vector<NamedModel>& models);
  [[nodiscard]] std::size_t size() const noexcept { return components_.size(); }
  [[nodiscard]] const Model& model(std::size_t component) const { return components_[component].model; }
  [[nodiscard]] std::span<const std::string> simulation_names(std::size_t component) const {
    return components_[component].simulations;
  }
  /// Whose result it is, ascending: that of all for a result of the whole frame, and of none for another component's.
  [[nodiscard]] std::vector<std::size_t> concerned(const wire::WireResult& result) const;
  /// The description of the one model, see model_packet(), or a packet with that of each of several.
  [[nodiscard]] std::string description(const nlohmann::json& recording) const;
  /// The component that "component=" of an address names; 0 without. Nothing when there is no such component.
  [[nodiscard]] std::optional<std::size_t> component_in(std::string_view target) const;
  /// Before the names of its exported files; empty with one component.
  [[nodiscard]] std::string file_prefix(std::size_t component) const;
  /// "/export/mesh.vtu?component=1&shape=3:17:0.75,4:16:0.25".
  [[nodiscard]] std::optional<http::Response> respond(std::string_view target) const;
  /// With one component, its scene, with both heads; see SceneBuilder. With several, one packet: sections "component0",
  /// ...: the scene of each, with its own head and without the cloud; "cloud": points x 4, as in the scene of one, with
  /// the distance from the nearest estimate.
  [[nodiscard]] std::string build(const AssembledMoment& moment, nlohmann::json head,
                                  std::vector<nlohmann::json> heads) const;

 private:
  struct Component {
    explicit Component(const NamedModel& named);
    std::string name;
    Model model;
    ModelRanges ranges;
    std::vector<std::string> simulations;  // their names
    SceneBuilder scenes;
  };
  std::deque<Component> components_;
  SceneBox box_;  // of all
};

}  // namespace lbea::tool
