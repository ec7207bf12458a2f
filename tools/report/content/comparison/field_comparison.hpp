// The displacements of the surface in the test and in one simulation, compared as CWA 16799:2014 does: both fields are
// decomposed into the same orthogonal shapes, and their coefficients must agree within the uncertainty of the test's.
// The workshop agreement has images and polynomials; here the shapes are the eigenvectors of the component's surface.
#pragma once

#include "tools/report/content/channels/channel_study.hpp"
#include "tools/report/content/frame_study.hpp"
#include "tools/shared/matching/shapes.hpp"

namespace lbea::tool {

/// The eigenvectors of a reference mesh, scaled so that the mean square of each over the surface is 1: coefficients
/// have the length unit, and their squares add up to the mean square of the field (Parseval).
class SurfaceShapes {
 public:
  SurfaceShapes(const Model& model, std::uint32_t reference);

  [[nodiscard]] std::uint32_t reference() const noexcept { return reference_; }
  /// Of a field with three components per vertex of the reference: modes x 3.
  [[nodiscard]] std::vector<double> coefficients(std::span<const double> field) const;
  /// Of a shape's positions instead of its displacements, by the coefficients that the model has of its samples: only
  /// their differences between shapes mean the same.
  [[nodiscard]] std::vector<double> baked_coefficients(const Model& model, const Shape& shape) const;
  /// Root of the mean square over the surface of what the coefficients lack of the field (CWA 16799, average residual).
  [[nodiscard]] double average_residual(std::span<const double> field, std::span<const double> coefficients) const;

 private:
  std::uint32_t reference_;
  std::size_t modes_;
  double root_share_ = 0;       // 1 / sqrt(area): from the model's coefficients to these
  std::vector<double> shares_;  // of the surface, per vertex
  std::vector<double> values_;  // modes x vertices
};

/// What the comparison says of a frame. Undecided: no coefficient contradicts, but u is too large to tell the
/// ensemble's simulations apart, or the shapes do not represent the field.
enum class FieldAgreement : std::uint8_t { acceptable, undecided, not_acceptable };

/// Of one frame. Lengths in the model's unit.
struct ComparedFields {
  double time_s = 0;                // since the test's first frame
  std::vector<double> differences;  // test minus simulation, modes x 3
  double test_uncertainty = 0;      // half of error_90
  double average_residual = 0;      // of the test's field, see SurfaceShapes
  /// The largest standard deviation of a coefficient over the simulations at this time, by the model's coefficients.
  /// These are of the nearest points of the deformed surface, so it is a little too small.
  double spread = 0;

  /// u, of each coefficient of the test.
  [[nodiscard]] double uncertainty() const noexcept;
  /// How many coefficients differ by at most 2 u.
  [[nodiscard]] std::size_t agreeing() const noexcept;
  [[nodiscard]] FieldAgreement agreement() const noexcept;
  /// Place of the largest one.
  [[nodiscard]] std::size_t largest() const noexcept;
};

struct FieldComparison {
  std::vector<ComparedFields> frames;  // studied ones, after the impact until the simulation's end
  std::string why_not;                 // without frames: a sentence's rest

  [[nodiscard]] std::size_t count(FieldAgreement agreement) const noexcept;
  /// Not acceptable in any frame: not acceptable; else undecided without an acceptable one.
  [[nodiscard]] FieldAgreement agreement() const noexcept;
};

/// Of the estimates of the studied frames, with the simulation of `channels` at the same time since the impact. An
/// estimate is composed of simulations: without a simulation that explains the test it shows nothing of them.
/// is_explained: by the verdict of the test.
[[nodiscard]] FieldComparison compare_fields(const Model& model, const FrameStudy& frames, const ChannelStudy& channels,
                                             bool is_explained);

}  // namespace lbea::tool
