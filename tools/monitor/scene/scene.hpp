// What the 3D view shows at one moment, as a packet.
#pragma once

#include "adapters/wire/codec/messages.hpp"
#include "precompute/registration/surface_tree.hpp"
#include "tools/monitor/scene/model_pages.hpp"
#include "tools/monitor/scene/shape.hpp"

#include <lbea/lbea.hpp>

#include <nlohmann/json_fwd.hpp>

#include <memory>
#include <optional>
#include <vector>

namespace lbea::tool {

/// A measured cloud in the reference's coordinates and what was said of it.
struct Moment {
  wire::WireResult result;
  std::shared_ptr<const std::vector<Point>> cloud;  // null: none
};

/// Best samples for the view: what explains the frame, the best sample, the best one of another simulation.
struct Leaders {
  Shape estimate;  // with method fit; else the best sample alone
  Shape match, ghost;
};
[[nodiscard]] Leaders leaders_of(const wire::WireResult& result);

/// The result as the page reads it, with what the test so far says.
[[nodiscard]] nlohmann::json to_json(const wire::WireResult& result);

class SceneBuilder {
 public:
  SceneBuilder(const Model& model, ModelRanges ranges);
  /// Adds "scene" to `head` and finishes the packet. Sections: "estimate", "match", "ghost": nodes x 3; "field0", ...:
  /// of the estimate; "match_field0", ...: of the match; "cloud": points x 4, u16: position in the scene's box, and
  /// distance from the estimate as a share of its limit.
  [[nodiscard]] std::string build(const Moment& moment, nlohmann::json head);

 private:
  [[nodiscard]] nlohmann::json add_meshes(const Leaders& leaders, class Packet& packet);
  [[nodiscard]] nlohmann::json add_cloud(const std::vector<Point>& points, class Packet& packet) const;

  const Model& model_;
  ModelRanges ranges_;
  std::vector<std::array<std::uint32_t, 4>> elements_;
  std::optional<bake::SurfaceTree> surface_;  // of the estimate; not set: no mesh
};

/// Beyond this a point is shown as "far from the mesh", length unit.
inline constexpr float distance_limit = 10.0f;

}  // namespace lbea::tool
