// lbea.hpp - find the simulations that look like the point-cloud frame just captured.
//
// Set-up (Model::open, the constructor of Matcher) may allocate, read the disk and throw lbea::Error.
// The loop (Matcher::match) does not allocate, lock, call the system or throw.
//
// Units: lengths in the model's length unit (mm unless the ensemble says otherwise), times in s in the
// model and ns on frames. Distances are never squared. Indices start at 0; ties go to the lower index.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <lbea/api.h>
#include <lbea/version.hpp>

namespace lbea {

/// A measured position in sensor coordinates.
struct Point {
  float x, y, z;
};

/// A rigid transform `T_to_from` as a row-major 3x4 matrix: to = R * from + t.
using RigidTransform = std::array<float, 12>;
inline constexpr RigidTransform identity_transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// One captured cloud. Does not own the points: the caller keeps them alive during match().
struct Frame {
  std::uint64_t id = 0;       // set by the sender, increases by one per frame
  std::int64_t stamp_ns = 0;  // capture time on the sender's clock
  std::span<const Point> points{};
};

enum class Method : std::int32_t {
  lbea,  // eq. 3: distance of coefficients in the Laplace-Beltrami eigenbasis
  vtp,   // eq. 1: distance of corresponding positions
  fit,   // LBEA proposes samples, the comparison of depth images decides; needs SensorViews
};

/// Whether the ensemble as a whole explains a frame.
enum class Verdict : std::int32_t {
  unknown = 0,         // not determined (lbea, vtp), or the frame showed too little or has too few points
  matched,             // one shape explains the frame as well as the runs of the ensemble explain each other
  ambiguous,           // several simulations with clearly different shapes explain it
  no_simulation_fits,  // none explains it: the residual is larger than that of a left-out simulation
};
[[nodiscard]] LBEA_API std::string_view to_string(Verdict verdict) noexcept;

/// How the reference mesh `sim_ref` is chosen (method step 2).
enum class ReferenceMode : std::uint32_t {
  impact,     // (a) the undeformed mesh of one run at impact, for every frame
  over_time,  // (b) the same run at the time of the frame
};

/// One row of the ensemble: a run and the index of the stored state in it.
struct Sample {
  std::uint32_t simulation = 0;
  std::uint32_t time_step = 0;
  friend bool operator==(const Sample&, const Sample&) = default;
};

/// A sample with its distance to the frame.
/// LBEA: eq. 3 as it stands, sum over modes of |e_j - s_j| (length unit squared, because psi' M psi = I).
/// VtP: eq. 1 divided by the number of vertices, the mean distance per vertex (length unit).
/// Fit: mean distance of the sample's nodes from the estimate's (length unit); 0 if the estimate is this sample. It
/// does not include the estimate's own error, which error_90 bounds.
struct Match {
  Sample sample;
  float distance = 0;
};

enum class Status : std::int32_t {
  ok = 0,
  // per frame, returned by the loop
  empty_frame,      // no finite point inside the ensemble's envelope
  too_many_points,  // more than MatcherConfig::max_points: refused, never truncated
  low_coverage,     // matched, but too little of the surface was seen to trust it
  // at set-up, carried by Error
  file_not_found,
  not_a_model,
  unsupported_version,
  corrupt_model,
  bad_config,
  bad_input,          // a file or message that is damaged or not what it claims to be
  unsupported_input,  // intact, but of a kind this program does not read
  write_failed,
  endpoint_unavailable,
};
inline constexpr std::int32_t status_count = 13;
/// Stable lower-case name, e.g. "low_coverage"; "unknown_status" for a value that is none of the above.
[[nodiscard]] LBEA_API std::string_view to_string(Status status) noexcept;

/// The only exception of set-up. what() names file, section and byte, and the remedy.
struct LBEA_API Error : std::runtime_error {
  Error(Status s, const std::string& sentence) : std::runtime_error(sentence), status(s) {}
  Status status;
};

/// A quantity carried along with every sample, e.g. plastic strain per element.
struct FieldInfo {
  enum class Location : std::uint32_t { element, node };
  std::string_view name, unit;
  Location location = Location::element;
  float largest_error = 0;  // of any value, in the field's unit: 0 when stored unchanged, else half of a 16-bit step
};

/// What a channel is.
enum class ChannelKind : std::uint32_t {
  displacement,  // of a node since the run's first state, in the coordinates of the component
  velocity,      // of a node, filtered
  acceleration,  // of a node, filtered
  distance,      // of two nodes
  intrusion,     // of a node since the run's first state, along axes that move with three nodes
  minimum,       // of a field over elements
  maximum,       // of a field over elements
  mean,          // of a field over elements, weighted by their areas at impact
  history,       // a number per state that the solver wrote, of the run, a part or a rigid wall
};
enum class ChannelComponent : std::uint32_t { x, y, z, resultant };
inline constexpr std::array<std::string_view, 9> channel_kind_names{
    "displacement", "velocity", "acceleration", "distance", "intrusion", "minimum", "maximum", "mean", "history"};
inline constexpr std::array<std::string_view, 4> channel_component_names{"x", "y", "z", "resultant"};
[[nodiscard]] constexpr std::string_view to_string(ChannelKind kind) noexcept {
  return channel_kind_names[static_cast<std::size_t>(kind)];
}
[[nodiscard]] constexpr std::string_view to_string(ChannelComponent component) noexcept {
  return channel_component_names[static_cast<std::size_t>(component)];
}

/// A quantity of interest that the ensemble description names; a number per sample.
struct ChannelInfo {
  std::string_view name, unit;
  ChannelKind kind = ChannelKind::displacement;
  ChannelComponent component = ChannelComponent::resultant;  // of a distance, field or history: resultant
  std::uint32_t cfc = 0;  // channel frequency class of SAE J211 by which it is filtered; 0: it is not
};

/// A channel in a frame. The true value differs by less than bound_90 in 90 % of the frames of runs that are not in the
/// ensemble; NaN: not known (other methods than fit, no simulation fits, most is hidden, or the rig's pose is not the
/// model's).
struct ChannelValue {
  float value = std::numeric_limits<float>::quiet_NaN();
  float bound_90 = std::numeric_limits<float>::quiet_NaN();
};

/// A share of a sample in a combination. Shares add up to 1; small ones may be negative: the shape lies beside the
/// samples.
struct WeightedSample {
  Sample sample;
  float weight = 0;  // shares are positive and add up to 1
};

struct LengthUnit {
  std::string_view name;
  double per_mm = 1;  // how many of it make a millimeter
};
inline constexpr std::array<LengthUnit, 6> length_units{
    {{"mm", 1}, {"cm", 0.1}, {"m", 1e-3}, {"um", 1e3}, {"in", 1 / 25.4}, {"ft", 1 / 304.8}}};

/// How many of `unit` make a millimeter; 1 for one that is not in the list.
[[nodiscard]] constexpr double units_per_mm(std::string_view unit) noexcept {
  for (const LengthUnit& known : length_units)
    if (known.name == unit) return known.per_mm;
  return 1;
}

struct ModelView;     // the validated sections of a model file, runtime-internal
struct DepthImages;   // the depth images and their camera, runtime-internal
class TestHistory;    // see lbea/test_history.hpp
struct HistoryState;  // runtime-internal

/// The baked file. Immutable: threads may share it. Copies share one mapping.
class LBEA_API Model {
 public:
  /// Maps `file` read-only and checks it in one pass; later reads need no check. Sections that matching reads are
  /// loaded into memory; the others are read from the file on demand, so a model may be larger than memory. Throws
  /// Error{file_not_found | not_a_model | unsupported_version | corrupt_model}.
  static Model open(const std::filesystem::path& file);
  /// The same for an image in memory. It must be 64-byte aligned; the caller keeps it alive.
  static Model view(std::span<const std::byte> image);

  /// Size of the file.
  [[nodiscard]] std::uint64_t bytes() const noexcept;
  /// Size of the part that matching by `method` may read in any frame; for vtp that is the whole file.
  [[nodiscard]] std::uint64_t hot_bytes(Method method = Method::lbea) const noexcept;
  /// Replaces exactly that part by a copy, which writing to the file does not change. False when the copy does not fit
  /// into three quarters of the machine's memory. Call it before the model is used. Throws
  /// Error{bad_config | corrupt_model} when the system grants no memory, or the file was written to since it was
  /// opened.
  bool hold(Method method = Method::lbea) const;
  /// Whether the file was written to since it was opened. Then what is read from it may be wrong, and reading ends the
  /// process (SIGBUS) if the file became shorter. Replacing the file by renaming another one is safe.
  [[nodiscard]] bool file_was_written() const noexcept;
  /// Locks exactly that part in RAM as long as the model is open, even when the process has locked all its memory
  /// before. False when the system refuses, with the reason in errno. For a model in the caller's memory, unlocking the
  /// other parts is left to the caller.
  bool lock(Method method = Method::lbea) const;

  // sizes
  [[nodiscard]] std::uint32_t vertices() const noexcept;  // n, of the observed region
  [[nodiscard]] std::uint32_t modes() const noexcept;     // p
  [[nodiscard]] std::uint32_t samples() const noexcept;   // s
  [[nodiscard]] std::uint32_t simulations() const noexcept;
  [[nodiscard]] std::uint32_t references() const noexcept;  // 1 at impact, time steps over time
  [[nodiscard]] std::uint32_t nodes() const noexcept;       // of the whole component
  [[nodiscard]] std::uint32_t elements() const noexcept;
  [[nodiscard]] ReferenceMode reference_mode() const noexcept;
  [[nodiscard]] std::string_view length_unit() const noexcept;
  [[nodiscard]] std::uint64_t checksum() const noexcept;       // of the directory, which covers every byte
  [[nodiscard]] std::string_view provenance() const noexcept;  // JSON: tool version, inputs and their hashes

  // the ensemble
  [[nodiscard]] std::string_view simulation_name(std::uint32_t simulation) const noexcept;
  [[nodiscard]] std::uint32_t parameters() const noexcept;
  [[nodiscard]] std::string_view parameter_name(std::uint32_t parameter) const noexcept;
  [[nodiscard]] double parameter(std::uint32_t simulation, std::uint32_t parameter) const noexcept;  // NaN: not given
  [[nodiscard]] Sample sample(std::uint32_t index) const noexcept;
  [[nodiscard]] double sample_time_s(std::uint32_t index) const noexcept;
  /// Row of `sample` in the ensemble; samples() when the model does not contain it.
  [[nodiscard]] std::uint32_t sample_index(Sample sample) const noexcept;

  // the component: the whole mesh of every sample, including what the cameras cannot see
  [[nodiscard]] std::span<const std::uint32_t> node_ids() const noexcept;       // nodes(), solver numbering
  [[nodiscard]] std::span<const std::uint32_t> element_ids() const noexcept;    // elements()
  [[nodiscard]] std::span<const std::uint32_t> element_parts() const noexcept;  // elements(), part ids
  /// elements() x 4; a triangle repeats its last node.
  [[nodiscard]] std::span<const std::uint32_t> element_nodes() const noexcept;
  [[nodiscard]] std::span<const float> node_positions(std::uint32_t sample) const noexcept;  // nodes() x 3
  [[nodiscard]] std::uint32_t fields() const noexcept;
  [[nodiscard]] FieldInfo field(std::uint32_t field) const noexcept;
  /// Values per sample: elements() or nodes().
  [[nodiscard]] std::uint32_t field_size(std::uint32_t field) const noexcept;
  /// into: field_size(field) values, within FieldInfo::largest_error of the simulation's.
  void read_field(std::uint32_t field, std::uint32_t sample, std::span<float> into) const noexcept;
  /// The same without a copy; empty when the field is stored in 16 bits.
  [[nodiscard]] std::span<const float> field_values(std::uint32_t field, std::uint32_t sample) const noexcept;

  // quantities of interest, computed from the runs' own states
  [[nodiscard]] std::uint32_t channels() const noexcept;
  [[nodiscard]] ChannelInfo channel(std::uint32_t channel) const noexcept;
  [[nodiscard]] float channel_value(std::uint32_t channel, std::uint32_t sample) const noexcept;

  // the observed region and its basis, per reference mesh
  /// n: vertex -> node.
  [[nodiscard]] std::span<const std::uint32_t> vertex_nodes(std::uint32_t reference) const noexcept;
  [[nodiscard]] std::span<const float> vertex_positions(std::uint32_t reference) const noexcept;  // n x 3
  [[nodiscard]] std::span<const double> eigenvalues(std::uint32_t reference) const noexcept;      // p, ascending
  [[nodiscard]] double reference_time_s(std::uint32_t reference) const noexcept;
  /// The three (mode, coordinate) pairs with the highest variance over the samples, as indices into a mode-major
  /// p x 3 array of coefficients: the axes of the joint low-dimensional plot (method step 8).
  [[nodiscard]] std::array<std::uint32_t, 3> leading_axes(std::uint32_t reference) const noexcept;
  /// The sample's coefficients for these pairs.
  [[nodiscard]] std::array<float, 3> leading_coordinates(std::uint32_t reference, std::uint32_t sample) const noexcept;

  // deformation branches: groups of simulations with similar last states
  [[nodiscard]] std::uint32_t branches() const noexcept;
  [[nodiscard]] std::uint32_t branch_of(std::uint32_t simulation) const noexcept;

  [[nodiscard]] const ModelView& view() const noexcept { return *view_; }

 private:
  explicit Model(std::shared_ptr<const ModelView> view) : view_(std::move(view)) {}
  std::shared_ptr<const ModelView> view_;
};

/// What the sensor would see of every sample: one coarse depth image per sample, and how well the simulations explain
/// each other in these images. Immutable; copies share the images.
class LBEA_API SensorViews {
 public:
  SensorViews() = default;  // none
  explicit SensorViews(std::shared_ptr<const DepthImages> data) : data_(std::move(data)) {}
  /// The ones baked into the model, for the pose that it was baked for; empty when it was baked without a sensor.
  [[nodiscard]] static SensorViews baked_into(const Model& model);
  /// Of a model that was baked for several rigs: those whose pose is nearest to this one.
  [[nodiscard]] static SensorViews baked_into(const Model& model, const RigidTransform& T_reference_sensor);

  [[nodiscard]] bool empty() const noexcept { return data_ == nullptr; }
  [[nodiscard]] std::uint32_t columns() const noexcept;
  [[nodiscard]] std::uint32_t rows() const noexcept;
  /// The pose of the rendered images. The pose of the frames may differ by a few degrees.
  [[nodiscard]] const RigidTransform& T_reference_sensor() const noexcept;
  /// rows() x columns(), along the optical axis in the length unit; NaN where the sensor sees nothing.
  [[nodiscard]] std::vector<float> depth_image(std::uint32_t sample) const;
  /// Expected residual of a run that is not in the ensemble, at the sample's time step: the median over the
  /// simulations, each left out once and compared with the best sample of the others. Length unit.
  [[nodiscard]] float expected_residual(std::uint32_t sample) const noexcept;
  /// When the residual exceeds the expected one by more than this factor, no simulation fits the frame.
  [[nodiscard]] float misfit_limit() const noexcept;
  /// The same for the geometric mean over a test, which is much more reliable.
  [[nodiscard]] float test_misfit_limit() const noexcept;

  [[nodiscard]] const DepthImages* data() const noexcept { return data_.get(); }

 private:
  std::shared_ptr<const DepthImages> data_;
};

struct MatcherConfig {
  std::uint32_t max_points = 131'072;  // a larger frame is refused, never truncated
  std::uint32_t max_matches = 5;       // how many samples to return, best first
  Method method = Method::lbea;
  float trusted_distance = 0;   // length unit; a vertex counts as seen when a point is within it; 0: 3 mm
  float min_coverage = 0.25f;   // below this coverage the status is low_coverage (the result is still filled)
  std::int64_t trigger_ns = 0;  // the sender's clock at impact: selects the reference mesh over time
  RigidTransform T_reference_sensor = identity_transform;
};

/// Number of a frame's points: received = used + invalid + culled. Of a refused frame (too_many_points), received
/// alone.
struct PointTally {
  std::uint32_t received = 0;
  std::uint32_t invalid = 0;  // not finite
  std::uint32_t culled = 0;   // outside the ensemble's envelope: background, other components
  std::uint32_t used = 0;
};

/// Wall time of each stage of one match().
struct StageTimes {
  std::uint32_t index = 0;  // transform, cull, sort into leaves
  // 0 by fit, unless eq. 3 proposes the samples:
  std::uint32_t correspondence = 0;  // nearest point of every vertex
  std::uint32_t projection = 0;
  std::uint32_t matching = 0;  // search of the samples
  std::uint32_t coverage = 0;
  std::uint32_t fit = 0;  // depth image, comparison with the samples', estimate
  // parts of fit
  std::uint32_t depth_image = 0, ranking = 0, estimate = 0, judgment = 0;
};

/// The name and the meaning of a number of a result. Messages, tables and Python take the numbers from the lists of
/// these.
template <class Numbers>
struct NumberInfo {
  const char* name;
  float Numbers::*value;
  const char* meaning;
};

/// Numbers of a frame, by all methods.
struct FrameNumbers {
  float coverage = 0;
};
inline constexpr std::array frame_numbers{
    NumberInfo<FrameNumbers>{"coverage", &FrameNumbers::coverage,
                             "share of the observed surface (fit: of its part in view) that the frame shows"}};

/// Numbers of a frame, by Method::fit; NaN with the other methods.
struct FitNumbers {
  float residual = std::numeric_limits<float>::quiet_NaN();
  float estimate_residual = std::numeric_limits<float>::quiet_NaN();
  float misfit = std::numeric_limits<float>::quiet_NaN();
  float spread = std::numeric_limits<float>::quiet_NaN();
  float error_90 = std::numeric_limits<float>::quiet_NaN();
  float pose_turn = std::numeric_limits<float>::quiet_NaN();
  float pose_shift = std::numeric_limits<float>::quiet_NaN();
  float pose_turn_sd = std::numeric_limits<float>::quiet_NaN();
  float pose_shift_sd = std::numeric_limits<float>::quiet_NaN();
  float test_time = std::numeric_limits<float>::quiet_NaN();
  float test_time_sd = std::numeric_limits<float>::quiet_NaN();
};
inline constexpr std::array fit_numbers{
    NumberInfo<FitNumbers>{"residual", &FitNumbers::residual,
                           "of the best candidate: root mean square of the depth differences, capped; length unit"},
    NumberInfo<FitNumbers>{"estimate_residual", &FitNumbers::estimate_residual, "the same for the estimate"},
    NumberInfo<FitNumbers>{"misfit", &FitNumbers::misfit,
                           "residual over the expected residual of a run that is not in the ensemble"},
    NumberInfo<FitNumbers>{"spread", &FitNumbers::spread,
                           "mean distance of the plausible samples from the estimate, length unit"},
    NumberInfo<FitNumbers>{
        "error_90", &FitNumbers::error_90,
        "the estimate's mean distance from the truth, over all nodes, is below this in 90 % of the "
        "frames of runs that are not in the ensemble; length unit; NaN: not known, or most is hidden"},
    NumberInfo<FitNumbers>{"pose_turn", &FitNumbers::pose_turn,
                           "angle of the test's pose error, which is corrected; degrees; NaN: not estimated"},
    NumberInfo<FitNumbers>{"pose_shift", &FitNumbers::pose_shift,
                           "the pose error's shift of the component's middle, which is corrected; length unit"},
    NumberInfo<FitNumbers>{"pose_turn_sd", &FitNumbers::pose_turn_sd, "standard deviation of the pose's turn, degrees"},
    NumberInfo<FitNumbers>{"pose_shift_sd", &FitNumbers::pose_shift_sd,
                           "standard deviation of the pose's shift, length unit"},
    NumberInfo<FitNumbers>{"test_time", &FitNumbers::test_time,
                           "time since the impact, by the test's stamps and the first frames that show a deformation, "
                           "seconds; NaN: not estimated"},
    NumberInfo<FitNumbers>{"test_time_sd", &FitNumbers::test_time_sd, "its standard deviation, seconds"}};

/// Result of Method::fit. Empty and NaN with the other methods.
struct SurfaceFit : FitNumbers {
  std::span<const Match> candidates{};         // the samples most similar to the frame; distance: their residual, and
                                               // what the history of the test counts against them
  std::span<const float> ranks{};              // per candidate, length unit: the least is the match
  std::span<const WeightedSample> estimate{};  // the combination of samples that explains the frame best
};

/// Spans are valid until the next match() on the same Matcher.
struct MatchResult : FrameNumbers {
  Status status = Status::ok;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::uint32_t reference = 0;  // the reference mesh that was used
  PointTally points{};
  // Positions in the basis, modes() x 3, mode-major: those of the frame; by fit those of the estimate, unless eq. 3
  // proposes the samples
  std::span<const float> coefficients{};
  std::span<const Match> matches{};            // best first; with fit by distance from the estimate and residual
  std::array<float, 3> leading_coordinates{};  // the coefficients of Model::leading_axes()
  SurfaceFit fit{};
  Verdict verdict = Verdict::unknown;
  StageTimes elapsed_ns{};
  /// Model::channels() values: of the estimate by fit, else of the best sample; none of a refused frame.
  std::span<const ChannelValue> channels{};
};

/// One per thread. Owns all scratch memory, allocated by the constructor.
class LBEA_API Matcher {
 public:
  /// Throws Error{bad_config} with the offending value.
  /// `views`: the depth images for Method::fit; when empty, those baked into the model. Frames must show the component
  /// from the side for which the images were rendered: other frames fit no simulation.
  explicit Matcher(Model model, const MatcherConfig& config = {}, SensorViews views = {});
  ~Matcher();
  Matcher(Matcher&&) noexcept;
  Matcher& operator=(Matcher&&) noexcept;

  /// Method steps 1-5 for one frame: correspondence, projection, nearest samples. Real-time safe.
  [[nodiscard]] MatchResult match(const Frame& frame) noexcept;
  /// The same with what the earlier frames of the test have shown, to which this one adds. While the pose error is not
  /// known yet, a frame is matched up to eight times. Methods other than Method::fit match as without.
  [[nodiscard]] MatchResult match(const Frame& frame, TestHistory& history) noexcept;

  [[nodiscard]] const Model& model() const noexcept;
  [[nodiscard]] const MatcherConfig& config() const noexcept;

 private:
  friend class RigMatcher;
  struct LBEA_HIDDEN State;
  [[nodiscard]] LBEA_HIDDEN MatchResult match(const Frame& frame, HistoryState* history) noexcept;
  std::unique_ptr<State> state_;
};

}  // namespace lbea
