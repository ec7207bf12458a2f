// How much of the samples' variance the p modes keep, in the inner product of M.
#pragma once

#include <Eigen/Dense>

#include <array>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <optional>
#include <vector>

namespace lbea {

/// Sums over samples f (n x 3) and their coefficients alpha = Psi' M f (p x 3), both relative to the reference mesh.
struct Moments {
  double samples = 0;
  double squared_positions = 0;      // sum of |f|_M^2
  double squared_coefficients = 0;   // sum of |alpha|^2
  Eigen::MatrixXd sum_positions;     // n x 3
  Eigen::MatrixXd sum_coefficients;  // p x 3
  Eigen::MatrixXd sum_squares;       // p x 3, of the coefficients one by one

  void add(const Eigen::VectorXd& mass, const Eigen::MatrixXd& positions,
           const Eigen::MatrixXd& coefficients);
  void add(const Moments& other);
  [[nodiscard]] double total(const Eigen::VectorXd& mass) const;  // sum of |f - mean f|_M^2
  [[nodiscard]] double kept() const;                              // sum of |alpha - mean alpha|^2
  /// The three (mode, coordinate) pairs that vary most, as places in a mode-major p x 3 array; ties to the lower place.
  [[nodiscard]] std::array<std::uint32_t, 3> leading_axes() const;
};

/// Adds up the runs' moments in the order of the runs, whoever comes first: sums of floating-point numbers depend on
/// their order, models must not. Safe from several threads.
class MomentsInOrder {
 public:
  explicit MomentsInOrder(std::size_t references) : sum_(references) {}
  /// of_run: one per reference.
  void add(std::size_t run, std::vector<Moments> of_run);
  /// Per reference, after all runs.
  [[nodiscard]] const std::vector<Moments>& sum() const noexcept { return sum_; }

 private:
  std::mutex mutex_;
  std::vector<std::optional<std::vector<Moments>>> waiting_;  // per run
  std::size_t next_ = 0;
  std::vector<Moments> sum_;
};

}  // namespace lbea
