// lbea.hpp - find the simulations that look like the point-cloud frame just captured.
//
// Set-up (Model::open, the constructor of Matcher) may allocate, read the disk and throw lbea::Error.
// The loop (Matcher::match) does none of that: no allocation, lock, system call or exception.
//
// Units: lengths in the model's length unit (mm unless the ensemble says otherwise), times in s in the
// model and ns on frames. Distances are never squared. Indices start at 0; ties go to the lower index.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>

#include <lbea/version.hpp>

namespace lbea {

/// A measured position in sensor coordinates.
struct Point {
  float x, y, z;
};

/// A rigid transform `T_to_from` as a row-major 3x4 matrix: to = R * from + t.
using RigidTransform = std::array<float, 12>;
inline constexpr RigidTransform identity_transform{1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

/// One captured cloud. A view: the caller keeps the points alive during match().
struct Frame {
  std::uint64_t id = 0;       // given by the sender, rises by one per frame
  std::int64_t stamp_ns = 0;  // capture time on the sender's clock
  std::span<const Point> points{};
};

enum class Method : std::int32_t {
  lbea,  // eq. 3: distance of coefficients in the Laplace-Beltrami eigenbasis
  vtp,   // eq. 1: distance of corresponding positions
};

/// How the reference mesh `sim_ref` is chosen (method step 2).
enum class ReferenceMode : std::uint32_t {
  impact,     // (a) the undeformed mesh of one run at impact, for every frame
  over_time,  // (b) the same run at the frame's own time
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
struct Match {
  Sample sample;
  float distance = 0;
};

enum class Status : std::int32_t {
  ok = 0,
  // per frame, returned by the loop
  empty_frame,      // no finite point inside the ensemble's envelope
  too_many_points,  // more than MatcherConfig::max_points: refused, never cut short
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
[[nodiscard]] std::string_view to_string(Status status) noexcept;

/// The one exception of set-up. what() is a sentence that names file, section, byte and what to do.
struct Error : std::runtime_error {
  Error(Status s, const std::string& sentence) : std::runtime_error(sentence), status(s) {}
  Status status;
};

/// A quantity carried along with every sample, e.g. plastic strain per element.
struct FieldInfo {
  enum class Location : std::uint32_t { element, node };
  std::string_view name, unit;
  Location location = Location::element;
};

struct ModelView;  // the validated sections of a model file, runtime-internal

/// The baked file, immutable. Copies share one mapping; share it freely between threads.
class Model {
 public:
  /// Maps `file` read-only and checks every byte that is later trusted.
  /// Throws Error{file_not_found | not_a_model | unsupported_version | corrupt_model}.
  static Model open(const std::filesystem::path& file);
  /// The same for an image in memory, 64-byte aligned, which the caller keeps alive.
  static Model view(std::span<const std::byte> image);

  // sizes
  [[nodiscard]] std::uint32_t vertices() const noexcept;     // n, of the observed region
  [[nodiscard]] std::uint32_t modes() const noexcept;        // p
  [[nodiscard]] std::uint32_t samples() const noexcept;      // s
  [[nodiscard]] std::uint32_t simulations() const noexcept;
  [[nodiscard]] std::uint32_t references() const noexcept;   // 1 at impact, time steps over time
  [[nodiscard]] std::uint32_t nodes() const noexcept;        // of the whole component
  [[nodiscard]] std::uint32_t elements() const noexcept;
  [[nodiscard]] ReferenceMode reference_mode() const noexcept;
  [[nodiscard]] std::string_view length_unit() const noexcept;
  [[nodiscard]] std::uint64_t checksum() const noexcept;  // of the directory, which covers every byte: names this model
  [[nodiscard]] std::string_view provenance() const noexcept;  // JSON: tool version, inputs and their hashes

  // the ensemble
  [[nodiscard]] std::string_view simulation_name(std::uint32_t simulation) const noexcept;
  [[nodiscard]] std::uint32_t parameters() const noexcept;
  [[nodiscard]] std::string_view parameter_name(std::uint32_t parameter) const noexcept;
  [[nodiscard]] double parameter(std::uint32_t simulation, std::uint32_t parameter) const noexcept;  // NaN: not given
  [[nodiscard]] Sample sample(std::uint32_t index) const noexcept;
  [[nodiscard]] double sample_time_s(std::uint32_t index) const noexcept;
  /// Row of `sample` in the ensemble; samples() when the model does not hold it.
  [[nodiscard]] std::uint32_t sample_index(Sample sample) const noexcept;

  // the component: every sample's whole mesh, also what the cameras cannot see
  [[nodiscard]] std::span<const std::uint32_t> node_ids() const noexcept;          // nodes(), the solver's numbering
  [[nodiscard]] std::span<const std::uint32_t> element_ids() const noexcept;       // elements()
  [[nodiscard]] std::span<const std::uint32_t> element_parts() const noexcept;     // elements(), part ids
  [[nodiscard]] std::span<const std::uint32_t> element_nodes() const noexcept;     // elements() x 4; a triangle repeats its last node
  [[nodiscard]] std::span<const float> node_positions(std::uint32_t sample) const noexcept;  // nodes() x 3
  [[nodiscard]] std::uint32_t fields() const noexcept;
  [[nodiscard]] FieldInfo field(std::uint32_t field) const noexcept;
  [[nodiscard]] std::span<const float> field_values(std::uint32_t field, std::uint32_t sample) const noexcept;

  // the observed region and its basis, per reference mesh
  [[nodiscard]] std::span<const std::uint32_t> vertex_nodes(std::uint32_t reference) const noexcept;  // n: vertex -> node
  [[nodiscard]] std::span<const float> vertex_positions(std::uint32_t reference) const noexcept;      // n x 3
  [[nodiscard]] std::span<const double> eigenvalues(std::uint32_t reference) const noexcept;          // p, ascending
  [[nodiscard]] double reference_time_s(std::uint32_t reference) const noexcept;

  [[nodiscard]] const ModelView& view() const noexcept { return *view_; }

 private:
  explicit Model(std::shared_ptr<const ModelView> view) : view_(std::move(view)) {}
  std::shared_ptr<const ModelView> view_;
};

struct MatcherConfig {
  std::uint32_t max_points = 131'072;  // a larger frame is refused, never cut short
  std::uint32_t max_matches = 5;       // how many samples to return, nearest first
  Method method = Method::lbea;
  float trusted_distance = 3.0f;  // length unit; a vertex counts as seen when a point lies this near
  float min_coverage = 0.25f;     // below this share seen, status is low_coverage (result still filled)
  std::int64_t trigger_ns = 0;    // the sender's clock at impact: picks the reference mesh over time
  RigidTransform T_reference_sensor = identity_transform;
};

/// What became of a frame's points: received = used + invalid + culled.
struct PointTally {
  std::uint32_t received = 0;
  std::uint32_t invalid = 0;  // not finite
  std::uint32_t culled = 0;   // outside the ensemble's envelope: background, other components
  std::uint32_t used = 0;
};

/// Wall time of each stage of one match().
struct StageTimes {
  std::uint32_t index = 0;           // transform, cull, sort into leaves
  std::uint32_t correspondence = 0;  // nearest point of every vertex
  std::uint32_t projection = 0;
  std::uint32_t matching = 0;  // search of the samples
  std::uint32_t coverage = 0;
};

/// Spans are valid until the next match() on the same Matcher.
struct MatchResult {
  Status status = Status::ok;
  std::uint64_t frame_id = 0;
  std::int64_t stamp_ns = 0;
  std::uint32_t reference = 0;              // which reference mesh was used
  PointTally points{};
  float coverage = 0;                       // share of the best sample's observed surface that the frame shows
  std::span<const float> coefficients{};    // the frame's positions in the basis, modes() x 3, mode-major
  std::span<const Match> matches{};         // nearest first
  StageTimes elapsed_ns{};
};

/// One per thread: owns all scratch memory, allocated here.
class Matcher {
 public:
  /// Throws Error{bad_config} with the offending value.
  explicit Matcher(Model model, const MatcherConfig& config = {});
  ~Matcher();
  Matcher(Matcher&&) noexcept;
  Matcher& operator=(Matcher&&) noexcept;

  /// Correspondence, projection, nearest samples: method steps 1-5. Real-time safe.
  [[nodiscard]] MatchResult match(const Frame& frame) noexcept;

  [[nodiscard]] const Model& model() const noexcept;
  [[nodiscard]] const MatcherConfig& config() const noexcept;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lbea
