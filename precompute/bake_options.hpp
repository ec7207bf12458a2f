// How a bake runs, as opposed to what it makes.
#pragma once

#include "precompute/depth_images/view_renderer.hpp"
#include "precompute/survey/common_mesh.hpp"

#include <array>
#include <cstdint>
#include <exception>
#include <functional>
#include <memory>
#include <span>
#include <string_view>
#include <vector>

namespace lbea::bake {

struct BakeProgress {
  std::string_view stage;  // "reading", "bases", "samples", "merging"
  std::uint64_t done = 0, total = 0;
};

struct BakeOptions {
  unsigned threads = 0;  // 0: all processors; the model does not depend on it
  /// One per node of the common mesh, 0 = hidden from the rig; positions: N x 3 at impact. Not set: all visible.
  std::function<std::vector<std::uint8_t>(const CommonMesh&, std::span<const float> positions)> visible_nodes;
  /// What renders the samples' depth images; low, high: box of all their positions. Not set: a model without them.
  std::function<std::unique_ptr<ViewRenderer>(const CommonMesh&, const std::array<float, 3>& low,
                                              const std::array<float, 3>& high)>
      views;
  std::function<void(const BakeProgress&)> progress;  // called from any thread, one call at a time
  std::function<bool()> cancelled;                    // asked after every state; true ends the bake with BakeCancelled
  bool verifies_finished = false;  // a shard reads what is finished, and makes it again when it is damaged
  bool leaves_out_broken = false;  // runs that cannot be read are left out and named; false: they end the bake
};

/// The caller's wish, not a failure. Nothing stands under the output's name then.
struct BakeCancelled : std::exception {
  [[nodiscard]] const char* what() const noexcept override { return "the bake was cancelled; no model was written"; }
};

}  // namespace lbea::bake
