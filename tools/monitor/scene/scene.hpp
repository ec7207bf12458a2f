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

/// The part of space that the view shows.
struct SceneBox {
  std::array<float, 3> lo{}, hi{};
  double distance_limit = 0;  // larger distances are shown as this one, length unit
};
/// As "scene" of a head.
[[nodiscard]] nlohmann::json json_of(const SceneBox& box);

/// Adds section "cloud": points x 4, u16: position in the box, and distance from the nearest surface as a share of its
/// limit. Returns how many points are shown.
[[nodiscard]] nlohmann::json add_cloud(const std::vector<Point>& points, const SceneBox& box,
                                       std::span<const std::optional<bake::SurfaceTree>> surfaces,
                                       class Packet& packet);

class SceneBuilder {
 public:
  SceneBuilder(const Model& model, const ModelRanges& ranges);
  [[nodiscard]] const SceneBox& box() const noexcept { return box_; }
  /// Adds "scene" to `head` and finishes the packet. Sections: "estimate", "match", "ghost" (the best sample of another
  /// simulation), "final" (at the end, as forecast): nodes x 3; "estimate_eroded", ...: elements that the first three
  /// have lost, if any; "field0", ...: of the estimate; "match_field0", ...: of the match; "cloud": see add_cloud().
  [[nodiscard]] std::string build(const Moment& moment, nlohmann::json head) const;
  /// The same without the cloud. Sets `surface` to that of the estimate, if there is one.
  [[nodiscard]] std::string build_meshes(const wire::WireResult& result, nlohmann::json head,
                                         std::optional<bake::SurfaceTree>& surface) const;

 private:
  [[nodiscard]] nlohmann::json scene_of(const wire::WireResult& result, class Packet& packet,
                                        std::optional<bake::SurfaceTree>& surface) const;
  [[nodiscard]] nlohmann::json add_meshes(const wire::WireResult& result, class Packet& packet,
                                          std::optional<bake::SurfaceTree>& surface) const;

  const Model& model_;
  SceneBox box_;
  std::vector<std::array<std::uint32_t, 4>> elements_;
};

}  // namespace lbea::tool
