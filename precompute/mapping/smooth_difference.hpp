// What differs smoothly between the undeformed shapes of two runs, as a bow or a tilt does. A point of the reference
// run's surface that is moved by it is near the same point of the component on the other run's surface; without it, the
// nearest point of a bowed face would be another one.
#pragma once

#include "precompute/mapping/reference_places.hpp"

#include <Eigen/Dense>

namespace lbea::bake {
/// A displacement whose components are polynomials of degree 4 of the position. Terms for which the surfaces give no
/// evidence, such as a motion of a plane in itself, are zero.
class SmoothDifference {
 public:
  static constexpr int terms = 35;  // monomials in x, y, z

  /// Least squares of the distances along the normals, from nodes of the reference run to the surface of another run.
  /// Zero unless it lowers these distances and moves no node by more than a twentieth of the component's diagonal.
  SmoothDifference(const ReferencePlaces& reference, const PartSurfaces& run);

  [[nodiscard]] std::array<double, 3> moved(const std::array<double, 3>& point) const noexcept;

 private:
  using Terms = Eigen::Matrix<double, terms, 1>;
  /// How far a node is from the other surface along its normal.
  struct Evidence {
    Terms terms;
    Eigen::Vector3d normal;
    double left;  // of the moved node
  };

  [[nodiscard]] Terms terms_at(const std::array<double, 3>& point) const noexcept;
  [[nodiscard]] WantedPlace moved(WantedPlace wanted) const noexcept;
  [[nodiscard]] std::vector<Evidence> evidence(const PartSurfaces& run, std::span<const WantedPlace> places) const;
  void fit(const std::vector<Evidence>& evidence);

  bool is_zero_ = true;
  std::array<double, 3> middle_{};
  double scale_ = 1, reach_ = 0;
  Eigen::Matrix<double, terms, 3> coefficients_ = Eigen::Matrix<double, terms, 3>::Zero();
};
}  // namespace lbea::bake
