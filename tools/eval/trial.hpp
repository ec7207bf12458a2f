// One experiment: its frames are sensed, matched with every method and compared with the truth.
#pragma once

#include "adapters/rig/sensor_json.hpp"
#include "precompute/mapping/body_frame.hpp"
#include "tools/eval/channels/channel_score.hpp"
#include "tools/eval/experiments.hpp"
#include "tools/eval/forecast/forecast_score.hpp"
#include "tools/eval/icp_baseline.hpp"
#include "tools/eval/truth.hpp"

#include <lbea/lbea.hpp>

#include <functional>

namespace lbea::tool {

/// vtp, lbea, icp: the methods of the preprint. look_alike: the sample whose depth image is nearest to that of the
/// frame. fit: the sample nearest to the estimate. estimate: the interpolated shape between samples. tracked: the most
/// likely sample given all frames so far. path: the same after the test, given all of its frames.
enum class EvaluatedMethod : std::size_t { vtp, lbea, icp, look_alike, fit, estimate, tracked, path };
inline constexpr std::size_t evaluated_methods = 8;
inline constexpr std::array<std::string_view, evaluated_methods> evaluated_method_names{
    "vtp", "lbea", "icp", "look_alike", "fit", "estimate", "tracked", "path"};

inline constexpr double not_measured = std::numeric_limits<double>::quiet_NaN();

struct FieldError {
  double true_mean = not_measured;  // of |value|, over all elements
  double matched = not_measured;    // mean |difference| of fit's best sample
  double inferred = not_measured;   // the same of the estimate
  double hidden = not_measured;     // the same of the estimate, over the elements outside the observed region
};

inline constexpr std::array<std::pair<const char*, double FieldError::*>, 4> field_errors{
    {{"true_mean", &FieldError::true_mean},
     {"matched", &FieldError::matched},
     {"inferred", &FieldError::inferred},
     {"hidden", &FieldError::hidden}}};

/// Whether 90 % bounds hold.
struct BoundCheck {
  double within = not_measured;  // share of the values whose error is within its bound
  double mean = not_measured;    // of the bounds
};
/// Of the estimate's mean error (error_90), of its node positions, and of the model's first field.
enum class Bounded : std::size_t { estimate, positions, field };
inline constexpr std::array<std::string_view, 3> bounded_names{"estimate", "positions", "field"};

struct FrameTrial : FrameNumbers {
  std::uint32_t step = 0;
  double time_s = 0;  // since impact
  std::size_t points = 0;
  Status status = Status::ok;
  Oracle best;                                             // the best sample possible
  std::array<double, evaluated_methods> errors{};          // EE; NaN: not measured
  std::array<std::uint32_t, evaluated_methods> samples{};  // rows of the model; samples(): none
  std::uint32_t own = 0;                                   // the experiment's own sample; samples(): not in S
  Verdict verdict = Verdict::unknown;                      // of this frame
  Verdict test_verdict = Verdict::unknown;                 // of the test so far
  SurfaceFit fit;                                          // its numbers; the spans are empty
  std::uint32_t simulation = 0;                            // the most likely of the test so far
  float simulation_probability = 0, branch_probability = 0;
  std::array<float, 3> leading_coordinates{};
  double pose_deg = not_measured, pose_error = not_measured;  // left after the estimate of the pose: about the middle
  double clock_error_ms = not_measured;                       // of the second rig, after the frame
  StageTimes vtp_ns, lbea_ns, fit_ns;
  double icp_s = not_measured;
  FieldError field;  // of the model's first field
  std::array<BoundCheck, bounded_names.size()> bounds;
  std::vector<ChannelScore> channels;  // of fit; empty: none
  double channels_ns = not_measured;

  [[nodiscard]] BoundCheck& of(Bounded bounded) noexcept { return bounds[static_cast<std::size_t>(bounded)]; }
};

/// The frame of a test in which the error of fit exceeds the oracle's most, as depth images. Empty when it never
/// exceeds it.
struct WorstFrame {
  std::uint32_t step = 0;
  double oracle = not_measured, fit = not_measured;  // EE
  std::uint32_t columns = 0;
  std::array<std::vector<float>, 3> images;  // of the frame, fit's sample, the oracle's; NaN: nothing seen
};

struct TestTrial {
  std::string experiment;
  std::uint32_t branch = 0;
  std::uint32_t fold = 0;  // from 1; 0: not one of several splits
  WorstFrame worst;
  std::vector<FrameTrial> frames;
  std::string named;       // the most likely simulation after the last frame
  bool contained = false;  // the experiment is one of the simulations
  std::optional<ForecastTrial> forecast;
};

struct TrialSettings {
  io::SensorDescription sensor{};
  std::vector<io::SensorDescription> more_rigs{};  // whose frames are fitted together with the sensor's
  bool disturbs_first_rig_alone = false;
  double clock_offset_ms = 0;  // that the clocks of these rigs are behind, unknown to the matcher
  Disturbance disturbance{};
  std::uint32_t first_step = 2, every = 1;
  std::uint32_t impact_step = 0;
  double time_factor = 1;
  bool estimate_pose = true;
  bool knows_impact = false;  // the matcher; else it estimates the stamp
  bool frames_alone = false;  // each frame is matched without what the earlier ones have shown
  std::uint64_t seed = 1;
  bake::MappingSettings mapping{};  // of runs with other meshes
  std::filesystem::path meshes{};   // folder for <experiment>/estimate.pvd and matched.pvd; empty: none
};

/// The model of a round of tests and its ICP baseline, shared by the threads that run the tests.
struct TestSetup {
  Model model;
  std::vector<bake::ChannelReport> channels{};  // of the model
  std::shared_ptr<IcpBaseline> icp{};           // null: not measured
  std::vector<SensorViews> more_views{};        // of TrialSettings::more_rigs
  std::shared_ptr<bake::BodyFrame> frame{};     // of the model's runs; null: as the solver wrote them

  /// In this frame.
  [[nodiscard]] std::unique_ptr<bake::SimulationReader> opened(const Experiment& experiment) const {
    return frame ? frame->fixed(experiment.open(), experiment.name) : experiment.open();
  }
};

/// Called after every frame; true ends the test.
using FrameDone = std::function<bool()>;

/// Throws the errors of reading the run and of the matcher.
[[nodiscard]] TestTrial run_test(const TestSetup& setup, const Experiment& experiment, const TrialSettings& settings,
                                 const FrameDone& done);

}  // namespace lbea::tool
