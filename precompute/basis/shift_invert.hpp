// The symmetric form A q = lambda q with A = M^-1/2 L M^-1/2 and q = M^1/2 psi, its shifted inverse and inertia.
#pragma once

#include <Eigen/Dense>
#include <Eigen/SparseCholesky>

#include <memory>

namespace lbea::bake {

/// (A - sigma I)^-1 restricted to the complement of the columns of `found`; the operator type Spectra expects.
class ShiftInvert {
 public:
  using Scalar = double;

  /// A is copied by reference and must outlive this. sigma < 0 makes A - sigma I positive definite.
  ShiftInvert(const Eigen::SparseMatrix<double>& a, double sigma);

  [[nodiscard]] Eigen::Index rows() const { return a_.rows(); }
  [[nodiscard]] Eigen::Index cols() const { return a_.cols(); }
  void set_shift(const double&) {}  // Spectra's hook: the shift is fixed here
  void perform_op(const double* x_in, double* y_out) const;

  /// Eigenvectors (orthonormal columns) the operator is blind to from now on.
  void deflate(Eigen::MatrixXd found) { found_ = std::move(found); }

 private:
  const Eigen::SparseMatrix<double>& a_;
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::MatrixXd found_;
};

/// Number of eigenvalues of A below `shift`: the negative pivots of A - shift I = P' L D L' P (Sylvester).
/// Throws Error{bad_input} when the factorisation breaks down.
[[nodiscard]] Eigen::Index eigenvalues_below(const Eigen::SparseMatrix<double>& a, double shift);

}  // namespace lbea::bake
