// Second pass over the runs, method steps 3 and 5. Intermediate results of one run: its samples as the model stores
// them, their sums, and what depends on the envelope grid and the sensor pose.
#pragma once

#include "precompute/bake_options.hpp"
#include "precompute/survey/envelope.hpp"
#include "precompute/work/bake_plan.hpp"

namespace lbea::bake {
/// One sample's rows of the model's sections. Those of a run that lacks elements hold `eroded`, too.
struct SampleRecord {
  std::vector<float> positions;                            // N x 3
  std::vector<std::vector<float>> fields;                  // [field][element]
  std::vector<std::vector<float>> coefficients;            // [reference][axis x padded mode]
  std::vector<std::vector<std::uint32_t>> correspondence;  // [reference][vertex]; empty without VtP
  std::vector<std::uint32_t> eroded;                       // as pack_eroded() makes it; zeros in other runs

  SampleRecord(const BakePlan& plan, const std::vector<ReferenceBasis>& bases);
  [[nodiscard]] std::size_t bytes() const;
};

/// run: of the sample.
void write_sample(WorkWriter& file, const SampleRecord& sample, const RunSurvey& run);
void read_sample(WorkReader& file, SampleRecord& sample, const RunSurvey& run);

/// Sums over samples f (n x 3) and their coefficients alpha = Psi' M f (p x 3), both relative to the reference mesh:
/// how much of the samples' variance the p modes keep, in the inner product of M.
struct Moments {
  double samples = 0;
  double squared_positions = 0;      // sum of |f|_M^2
  double squared_coefficients = 0;   // sum of |alpha|^2
  Eigen::MatrixXd sum_positions;     // n x 3
  Eigen::MatrixXd sum_coefficients;  // p x 3
  Eigen::MatrixXd sum_squares;       // p x 3, of the single coefficients

  void add(const Eigen::VectorXd& mass, const Eigen::MatrixXd& positions, const Eigen::MatrixXd& coefficients);
  void add(const Moments& other);
  [[nodiscard]] double total(const Eigen::VectorXd& mass) const;  // sum of |f - mean f|_M^2
  [[nodiscard]] double kept() const;                              // sum of |alpha - mean alpha|^2
  /// The three (mode, coordinate) pairs with the highest variance, as indices into a mode-major p x 3 array; ties to
  /// the lower index.
  [[nodiscard]] std::array<std::uint32_t, 3> leading_axes() const;
};

/// After the last sample of a record; one per reference.
void write_moments(WorkWriter& file, const std::vector<Moments>& moments);
[[nodiscard]] std::vector<Moments> read_moments(WorkReader& file);
/// After the moments: channels x samples of the run.
void write_channel_values(WorkWriter& file, const std::vector<float>& values);
[[nodiscard]] std::vector<float> read_channel_values(WorkReader& file);

/// Throws Error{bad_config} unless it renders as planned. rendering: may be empty.
[[nodiscard]] std::unique_ptr<DepthRenderer> planned_renderer(const DepthRendering& rendering, const Survey& survey,
                                                              const DepthCamera& planned);

/// The parts of a run's output that depend on the envelope grid and the sensor pose: depth images and the grid cells of
/// its surfaces. Made from the run's finished record, so that the run is not read again when these change.
/// renderer: null when the plan has no camera.
void write_grid_and_images(const WorkFolder& work, const BakePlan& plan, std::size_t run, SampleRecord& buffer,
                           const DepthRenderer* renderer);

/// Reads the depth images one by one, then the grid.
class GridAndImagesReader {
 public:
  GridAndImagesReader(const WorkFolder& work, const BakePlan& plan, std::size_t run)
      : file_(work.reader(plan.runs[run].grid_and_images_name())) {}
  void image(std::span<std::uint16_t> image) { file_.bytes(std::as_writable_bytes(image)); }
  /// After the run's last image.
  void envelope(EnvelopeBuilder& into);

 private:
  WorkReader file_;
};

/// The runs that were surveyed.
[[nodiscard]] std::vector<std::size_t> surveyed_runs(const BakePlan& plan);

/// Sets the camera of the depth images, and the keys of the runs' files. plan: with survey and bases.
void plan_samples(BakePlan& plan, const BakeOptions& options);

/// Writes the record, and grid and images, of each of these runs unless they are in the work folder already. Returns
/// the number of broken runs; their failures are noted in the work folder. Throws Error{bad_config | bad_input |
/// write_failed} and BakeCancelled.
std::size_t make_samples(const WorkFolder& work, const BakePlan& plan, const std::vector<std::size_t>& runs,
                         const BakeOptions& options);
}  // namespace lbea::bake
