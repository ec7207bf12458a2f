#include "precompute/basis/shift_invert.hpp"

#include <lbea/lbea.hpp>

namespace lbea::bake {
namespace {

Eigen::SparseMatrix<double> shifted(const Eigen::SparseMatrix<double>& a, double shift) {
  Eigen::SparseMatrix<double> identity(a.rows(), a.cols());
  identity.setIdentity();
  return a - shift * identity;
}

}  // namespace

ShiftInvert::ShiftInvert(const Eigen::SparseMatrix<double>& a, double sigma)
    : a_(a), factor_(shifted(a, sigma)), found_(a.rows(), 0) {
  if (factor_.info() != Eigen::Success)
    throw Error(Status::bad_input,
                "the Laplacian of the region cannot be factorised; are its elements badly distorted?");
}

void ShiftInvert::perform_op(const double* x_in, double* y_out) const {
  const Eigen::Map<const Eigen::VectorXd> x(x_in, rows());
  Eigen::Map<Eigen::VectorXd> y(y_out, rows());
  y = factor_.solve(x - found_ * (found_.transpose() * x));
  y -= found_ * (found_.transpose() * y).eval();
}

Eigen::Index eigenvalues_below(const Eigen::SparseMatrix<double>& a, double shift) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(shifted(a, shift));
  if (factor.info() != Eigen::Success)
    throw Error(Status::bad_input,
                "the eigenvalues of the region cannot be counted; are its elements badly distorted?");
  return (factor.vectorD().array() < 0).count();
}

}  // namespace lbea::bake
