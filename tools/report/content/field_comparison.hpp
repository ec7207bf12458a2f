// The displacements of the surface in the test and in one simulation, compared as CWA 16799:2014 does: both fields are
// decomposed into the same orthogonal shapes, and their coefficients must agree within the uncertainty of the test's.
// The workshop agreement has images and polynomials; here the shapes are the eigenvectors of the component's surface.
#pragma once

#include "tools/report/content/channels/channel_study.hpp"
#include "tools/report/content/frame_study.hpp"

namespace lbea::tool {

/// The eigenvectors of a reference mesh, scaled so that the mean square of each over the surface is 1: coefficients
/// have the length unit, and their squares add up to the mean square of the field (Parseval).
class SurfaceShapes {
 public:
  SurfaceShapes(const Model& model, std::uint32_t reference);

  [[nodiscard]] std::uint32_t reference() const noexcept { return reference_; }
  /// Of a field with three components per vertex of the reference: modes x 3.
  [[nodiscard]] std::vector<double> coefficients(std::span<const double> field) const;
  /// Root of the mean square over the surface of what the coefficients lack of the field (CWA 16799, average residual).
  [[nodiscard]] double average_residual(std::span<const double> field, std::span<const double> coefficients) const;

 private:
  std::uint32_t reference_;
  std::size_t modes_;
  std::vector<double> shares_;  // of the surface, per vertex
  std::vector<double> values_;  // modes x vertices
};

/// Of one frame. Lengths in the model's unit.
struct ComparedFields {
  double time_s = 0;                // since the test's first frame
  std::vector<double> differences;  // test minus simulation, modes x 3
  double average_residual = 0;      // of the test's field
  double uncertainty = 0;           // u, of each coefficient of the test

  /// How many coefficients differ by at most 2 u.
  [[nodiscard]] std::size_t agreeing() const noexcept;
  /// Whether all do: the simulation is acceptable.
  [[nodiscard]] bool is_acceptable() const noexcept { return agreeing() == differences.size(); }
  /// Place of the largest one.
  [[nodiscard]] std::size_t largest() const noexcept;
};

struct FieldComparison {
  std::vector<ComparedFields> frames;  // studied ones, between the impact and the simulation's end
  std::string why_not;                 // without frames: a sentence's rest
};

/// The standard uncertainty of a displacement of the estimate, whose error is normal: 90 % are within 1.645 of them.
inline constexpr double deviations_of_90_percent = 1.645;

/// Of the estimates of the studied frames, with the simulation of `channels` at the same time since the impact.
[[nodiscard]] FieldComparison compare_fields(const Model& model, const FrameStudy& frames,
                                             const ChannelStudy& channels);

}  // namespace lbea::tool
