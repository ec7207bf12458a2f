// How much of the samples' variance the p modes keep, in the inner product of M.
#pragma once

#include <Eigen/Dense>

#include <array>
#include <cstdint>

namespace lbea::bake {

/// Sums over samples f (n x 3) and their coefficients alpha = Psi' M f (p x 3), both relative to the reference mesh.
struct Moments {
  double samples = 0;
  double squared_positions = 0;      // sum of |f|_M^2
  double squared_coefficients = 0;   // sum of |alpha|^2
  Eigen::MatrixXd sum_positions;     // n x 3
  Eigen::MatrixXd sum_coefficients;  // p x 3
  Eigen::MatrixXd sum_squares;       // p x 3, of the coefficients one by one

  void add(const Eigen::VectorXd& mass, const Eigen::MatrixXd& positions, const Eigen::MatrixXd& coefficients);
  void add(const Moments& other);
  [[nodiscard]] double total(const Eigen::VectorXd& mass) const;  // sum of |f - mean f|_M^2
  [[nodiscard]] double kept() const;                              // sum of |alpha - mean alpha|^2
  /// The three (mode, coordinate) pairs that vary most, as places in a mode-major p x 3 array; ties to the lower place.
  [[nodiscard]] std::array<std::uint32_t, 3> leading_axes() const;
};

}  // namespace lbea::bake
