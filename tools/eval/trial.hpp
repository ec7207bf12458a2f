// One experiment, sensed and matched frame by frame with every method, beside the truth.
#pragma once

#include "adapters/rig/sensor_json.hpp"
#include "precompute/simulation.hpp"
#include "tools/eval/disturbance.hpp"
#include "tools/eval/experiment_error.hpp"
#include "tools/eval/icp_baseline.hpp"

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace lbea::tool {

/// vtp, lbea, icp: the preprint's. look_alike: the sample whose depth image is nearest to the frame's. fit: the sample
/// nearest to the estimate. estimate: the shape between the samples. tracked: the likeliest sample given all frames so
/// far. path: the same after the test, given all of its frames.
enum class Contender : std::size_t { vtp, lbea, icp, look_alike, fit, estimate, tracked, path };
inline constexpr std::size_t contenders = 8;
inline constexpr std::array<std::string_view, contenders> contender_names{"vtp", "lbea",     "icp",     "look_alike",
                                                                          "fit", "estimate", "tracked", "path"};

inline constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

struct FieldError {
  double true_mean = not_measured;      // of |value|, over all elements
  double matched = not_measured;        // mean |difference| of fit's best sample
  double inferred = not_measured;       // and of the estimate
  double hidden = not_measured;         // the same over the elements outside the observed region
  double within_spread = not_measured;  // share of elements within two spreads of the truth
};

struct FrameTrial {
  std::uint32_t step = 0;
  double time_s = 0;  // since impact
  std::size_t points = 0;
  Status status = Status::ok;
  Oracle best;                                      // no method that picks a sample can do better
  std::array<double, contenders> errors{};          // EE; NaN: not run
  std::array<std::uint32_t, contenders> samples{};  // rows of the model; samples(): none
  std::uint32_t own = 0;                            // the experiment's own sample; samples(): not in S
  Verdict verdict = Verdict::unknown;               // of this frame
  Verdict test_verdict = Verdict::unknown;          // of the test so far
  SurfaceFit fit;                                   // its numbers; the spans are cut off
  float coverage = 0;
  std::uint32_t simulation = 0;  // the likeliest of the test so far
  float simulation_probability = 0, branch_probability = 0;
  std::array<float, 3> leading_coordinates{};
  StageTimes vtp_ns, lbea_ns, fit_ns;
  double icp_s = not_measured;
  FieldError field;  // of the model's first field
};

struct TestTrial {
  std::string experiment;
  std::uint32_t branch = 0;
  std::vector<FrameTrial> frames;
  std::string named;       // the likeliest simulation after the last frame
  bool contained = false;  // the experiment is one of the simulations
};

struct Experiment {
  std::string name;
  std::function<std::unique_ptr<bake::SimulationReader>()> open;
};

struct TrialSettings {
  io::SensorDescription sensor{};
  Disturbance disturbance{};
  std::uint32_t first_step = 2, every = 1;
  std::uint32_t impact_step = 0;
  double time_factor = 1;
  std::uint64_t seed = 1;
  std::filesystem::path meshes{};  // folder for <experiment>/estimate.pvd and what it strings together; empty: none
};

/// What one model is asked: shared by the threads that run its tests.
struct Arena {
  Model model;
  SensorViews views;                 // empty: those baked into the model
  std::shared_ptr<IcpBaseline> icp;  // null: not run
};

/// Called after every frame; true ends the test there.
using FrameDone = std::function<bool()>;

/// Throws what reading the run and the matcher's set-up throw.
[[nodiscard]] TestTrial run_test(const Arena& arena, const Experiment& experiment, const TrialSettings& settings,
                                 const FrameDone& done);

}  // namespace lbea::tool
