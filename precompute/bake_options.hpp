// How a bake runs, what it reports while it runs, and what it returns.
#pragma once

#include "precompute/parallel.hpp"
#include "precompute/rig/depth_renderer.hpp"
#include "precompute/survey/common_mesh.hpp"

#include <chrono>
#include <functional>
#include <mutex>

namespace lbea::bake {
struct BakeProgress {
  std::string_view stage;  // "reading", "bases", "samples", "merging"
  std::uint64_t done = 0, total = 0;
};

/// Makes the renderer of the samples' depth images for a sensor; low, high: box of all sample positions.
using DepthRendering = std::function<std::unique_ptr<DepthRenderer>(const CommonMesh&, const std::array<float, 3>& low,
                                                                    const std::array<float, 3>& high)>;

/// Do not influence the model, except for the functions that stand for sensor descriptions.
struct BakeOptions {
  unsigned threads = 0;  // 0: all processors
  /// One per node of the common mesh, 0 = hidden from the rig; positions: N x 3 at impact. Not set: all visible.
  std::function<std::vector<std::uint8_t>(const CommonMesh&, std::span<const float> positions)> visible_nodes;
  DepthRendering depth_renderer;  // not set: a model without depth images
  std::vector<DepthRendering> more_depth_renderers;
  std::function<void(const BakeProgress&)> progress;  // called from any thread, one call at a time
  std::function<bool()> cancelled;                    // called from any thread; true ends the bake with BakeCancelled
  bool verifies_finished = false;  // a shard checks the bytes of finished files, and makes damaged ones again
  bool leaves_out_broken = false;  // runs that cannot be read are left out and named; false: they end the bake

  [[nodiscard]] Workers workers() const { return {threads, cancelled}; }
};

/// Reports the progress of one stage and checks for cancellation. Thread-safe.
class Stage {
 public:
  Stage(const BakeOptions& options, std::string_view name, std::uint64_t total)
      : options_(options), progress_{name, 0, total} {}

  /// Throws BakeCancelled.
  void check() const { options_.workers().check(); }
  void step() {
    const std::lock_guard lock(mutex_);
    ++progress_.done;
    if (options_.progress) options_.progress(progress_);
  }

 private:
  const BakeOptions& options_;
  std::mutex mutex_;
  BakeProgress progress_;
};

/// A run that is not in the model, and why.
struct RunLeftOut {
  std::string name, reason;
};

/// A run with another mesh, and how it was mapped.
struct MappedRunReport {
  std::string name;
  MappingReport mapping;
};

/// A field stored in 16 bits, and its largest rounding error.
struct RoundedField {
  std::string name, unit;
  float largest_error = 0;
};

/// A channel, and which nodes or elements it has.
struct ChannelReport {
  std::string name, unit;
  ChannelKind kind = ChannelKind::displacement;
  ChannelComponent component = ChannelComponent::resultant;
  std::uint32_t cfc = 0;
  std::vector<std::uint32_t> node_ids;
  std::vector<double> distances;             // of the nodes from the given points, length unit
  std::string field = {};                    // of a minimum, maximum or mean
  std::vector<std::uint32_t> elements = {};  // the same: of the model, ascending
  std::vector<double> areas = {};            // of these elements at impact, relative
  SolverHistory history = {};                // of a history
};

inline constexpr double largest_usual_residual = 1e-9;

struct BakeSummary {
  std::uint32_t vertices = 0, modes = 0, samples = 0, simulations = 0, references = 0;  // n, p, s
  std::uint32_t nodes = 0, elements = 0, fields = 0, parameters = 0;                    // N, E
  std::uint64_t file_size = 0;
  double kept_variance = 0;   // share of the samples' variance that p modes keep; NaN when nothing varies
  double basis_residual = 0;  // maximum over the references, see Eigenbasis; usually below largest_usual_residual
  std::string basis_solver;
  std::size_t degenerate_triangles = 0;  // of the reference meshes, skipped
  double highest_eigenvalue = 0;         // of the first reference, 1 / length^2
  std::array<float, 3> size{};           // of the box around the component in all samples, length unit
  std::string length_unit;
  double first_s = 0, last_s = 0;  // times of the samples
  double interval_s = 0;           // between two samples of a run, the median; 0: one sample per run
  std::vector<SimulationField> stored_fields;
  MeshLosses losses;
  std::vector<MappedRunReport> mapped;  // in the ensemble's order
  std::vector<std::string> warnings;    // what a user should check: a sentence each
  std::vector<RunLeftOut> left_out;     // in the ensemble's order
  std::vector<RoundedField> rounded_fields;
  std::vector<ChannelReport> channels;
  struct Seconds {
    double reading = 0, bases = 0, samples = 0, writing = 0;  // of the stages that this process did; writing: the merge
  } seconds;
};

[[nodiscard]] inline double seconds_since(std::chrono::steady_clock::time_point begin) noexcept {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}
}  // namespace lbea::bake
