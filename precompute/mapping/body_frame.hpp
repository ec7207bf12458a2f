// Runs in a frame that moves with the component: everything after this sees deformations only.
#pragma once

#include "precompute/ensemble.hpp"

#include <mutex>

namespace lbea::bake {

struct BodyFrameShape;

/// Opens runs without the rigid motion of some nodes. Safe from several threads.
class BodyFrame {
 public:
  using Opener = std::function<std::unique_ptr<SimulationReader>()>;

  /// nodes: set.
  BodyFrame(Opener reference, BodyFrameNodes nodes) : open_reference_(std::move(reference)), nodes_(std::move(nodes)) {}

  /// A reader of the same states, each of them moved rigidly so that the nodes, weighted by their undeformed area if
  /// they are all nodes, lie nearest to their undeformed places in the reference run (least squares, Kabsch 1976). It
  /// has four more histories, the motion that was removed: `rigid_x`, `rigid_y`, `rigid_z`, the displacement of the
  /// nodes' center, in the run's length unit, and `rigid_turn`, the angle, degrees.
  /// Throws Error{bad_config} when a node does not exist, is named twice or has no undeformed position, or the nodes
  /// lie on a line; Error{bad_input} naming `run` when it does not have the reference run's numbers, see
  /// has_numbers_of(). Reading throws Error{bad_input} naming run and state when a named node or every node is free,
  /// see free_nodes(), or the nodes lie on a line.
  [[nodiscard]] std::unique_ptr<SimulationReader> fixed(std::unique_ptr<SimulationReader> reader,
                                                        const std::string& run);

 private:
  std::shared_ptr<const BodyFrameShape> reference();

  Opener open_reference_;
  BodyFrameNodes nodes_;
  std::mutex mutex_;  // of the next one
  std::shared_ptr<const BodyFrameShape> reference_;
};

/// Whether a history of this name is one of the four.
[[nodiscard]] bool is_rigid_motion(std::string_view history);

/// With channels of the motion that is removed, if there is one.
[[nodiscard]] EnsembleDescription with_rigid_motion(EnsembleDescription description);

}  // namespace lbea::bake
