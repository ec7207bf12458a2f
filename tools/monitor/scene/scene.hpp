// The 3D view at one moment as a packet: measured cloud, matched shape, alternatives.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "precompute/registration/surface_tree.hpp"
#include "tools/monitor/scene/model_exports.hpp"
#include "tools/shared/matching/shapes.hpp"

namespace lbea::tool {

/// Parses "3:17:0.75,4:16:0.25": simulation, time step, weight. Nothing when the text has another form.
[[nodiscard]] std::optional<Shape> parse_shape(std::string_view text);

/// A measured cloud in reference coordinates with its result.
struct Moment {
  wire::WireResult result;
  std::shared_ptr<const std::vector<Point>> cloud;  // null: none
};

/// The result as the page reads it, with the state of the whole test.
[[nodiscard]] nlohmann::json to_json(const wire::WireResult& result);

class SceneBuilder {
 public:
  SceneBuilder(const Model& model, ModelRanges ranges);
  /// Adds "scene" to `head` and finishes the packet. Sections: "estimate", "match", "ghost" (the best sample of another
  /// simulation), "final" (at the end, as forecast): nodes x 3; "estimate_eroded", ...: elements that the first three
  /// have lost, if any; "field0", ...: of the estimate; "match_field0", ...: of the match; "cloud": points x 4,
  /// u16: position in the box of the scene, and distance from the estimate as a share of its limit.
  [[nodiscard]] std::string build(const Moment& moment, nlohmann::json head) const;

 private:
  /// Sets `surface` to that of the estimate.
  [[nodiscard]] nlohmann::json add_meshes(const wire::WireResult& result, class Packet& packet,
                                          std::optional<bake::SurfaceTree>& surface) const;
  [[nodiscard]] nlohmann::json add_cloud(const std::vector<Point>& points,
                                         const std::optional<bake::SurfaceTree>& surface, class Packet& packet) const;

  const Model& model_;
  ModelRanges ranges_;
  double distance_limit_;  // larger distances are shown as this one, length unit
  std::vector<std::array<std::uint32_t, 4>> elements_;
};

}  // namespace lbea::tool
