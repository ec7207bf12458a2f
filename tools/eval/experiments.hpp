// Experiments of an evaluation: which runs play them, how their frames are disturbed, and other components.
#pragma once

#include "precompute/ensemble.hpp"
#include "precompute/rig/stereo_sensor.hpp"
#include "precompute/simulation.hpp"

#include <lbea/lbea.hpp>

#include <functional>
#include <optional>

namespace lbea::tool {

struct Experiment {
  std::string name;
  std::function<std::unique_ptr<bake::SimulationReader>()> open;
};

/// Which runs are the simulations S and which are the experiments E: indices into the runs of an ensemble, ascending.
struct Split {
  std::vector<std::size_t> simulations, experiments;
};

/// `share` of the runs, rounded, chosen at random as experiments; at least one run on each side.
/// Throws Error{bad_config} for fewer than two runs or a share that is not between 0 and 1.
[[nodiscard]] Split random_split(std::size_t runs, double share, std::uint64_t seed);

/// The named runs are the experiments. Throws Error{bad_config} for an unknown name, or when no simulation is left.
[[nodiscard]] Split named_split(std::span<const bake::EnsembleRun> runs, std::span<const std::string> experiments);

/// One split per run, with this run as the only experiment. Throws Error{bad_config} for fewer than two runs.
[[nodiscard]] std::vector<Split> leave_one_out(std::size_t runs);

/// `count` splits, in which every run is an experiment once: the runs in random order, divided evenly. Throws
/// Error{bad_config} for a count that is not from 2 to the number of runs.
[[nodiscard]] std::vector<Split> folds(std::size_t runs, std::size_t count, std::uint64_t seed);

/// An ensemble of the chosen runs. Its reference run is the same, or the first chosen run when that is not chosen.
[[nodiscard]] bake::Ensemble subset(const bake::Ensemble& ensemble, std::span<const std::size_t> runs);

/// Errors of practice that are added to sensed frames.
struct Disturbance {
  std::string name = "as sensed";
  std::optional<float> noise{};     // length unit; default: the sensor's
  std::optional<float> outliers{};  // share; default: the sensor's
  double hidden = 0;                // share of the points that patches hide
  double connected = 0;       // share of the points that one connected patch hides, at another place in every frame
  bool same_place = false;    // the connected patch stays at one place for the whole test
  std::uint32_t window = 0;   // pixels: side of the windows that smear depths and lose edges; 0: none
  double kept = 1;            // share of the points, chosen at random
  double pose_error_deg = 0;  // remaining after registration: a turn about the component's middle
  double pose_error = 0;      // and a shift, length unit; both the same for the whole test, in random directions
  bool is_drifting = false;   // the pose error grows during the test, from nothing
};

[[nodiscard]] bake::SensingNoise disturbed(bake::SensingNoise noise, const Disturbance& disturbance);

/// Removes round patches around random points until `share` of the points is removed. `radius`: of a patch, in the unit
/// of the cloud; the last patch is smaller. The order of the remaining points is kept.
[[nodiscard]] std::vector<Point> hide_patches(std::vector<Point> points, double share, double radius,
                                              std::uint64_t seed);

/// Removes the `share` of the points that is nearest to `place`.
[[nodiscard]] std::vector<Point> hide_nearest(std::vector<Point> points, double share, const Point& place);

/// The points as stereo matching of windows of this many pixels measures them: a point has the mean depth of those in
/// its window, whatever surface they lie on, and is lost near an edge, where less than three quarters of its window is
/// full.
[[nodiscard]] std::vector<Point> smeared(std::vector<Point> points, const bake::StereoSensor& sensor,
                                         std::uint32_t window);

/// Keeps every point with probability `share`.
[[nodiscard]] std::vector<Point> thin(std::vector<Point> points, double share, std::uint64_t seed);

/// The points, sensor coordinates, as a sensor with the pose error would measure them. share: of the error. center: of
/// the turn, reference coordinates.
[[nodiscard]] std::vector<Point> misplaced(std::vector<Point> points, const Disturbance& disturbance, double share,
                                           const RigidTransform& T_reference_sensor, const Point& center,
                                           std::uint64_t seed);

/// What is left of that pose error after a correction in reference coordinates: the turn in degrees, and the distance
/// by which the center is off.
struct PoseError {
  double turn_deg = 0, shift = 0;
};
[[nodiscard]] PoseError left_over(const RigidTransform& correction, const Disturbance& disturbance, double share,
                                  const Point& center, std::uint64_t seed);

/// Hides patches with a radius of 7 % of the diagonal of the cloud's box, then the surroundings of `place` (of a random
/// point when there is none), then thins.
[[nodiscard]] std::vector<Point> disturbed(std::vector<Point> points, const Disturbance& disturbance,
                                           std::uint64_t seed, const std::optional<Point>& place = {});

/// A point at random. `points`: at least one.
[[nodiscard]] Point any_of_them(std::span<const Point> points, std::uint64_t seed);

/// Components that no simulation of the ensemble should fit: a round tube, a box with another cross section, a
/// corrugated plate and a ball, in the bounding box of the model's first sample. Each is compressed to 0.6 of its
/// longest side, in as many states as the longest simulation of the model has.
[[nodiscard]] std::vector<Experiment> other_components(const Model& model);

}  // namespace lbea::tool
