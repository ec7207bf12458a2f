#include "precompute/basis/lanczos.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::bake {
namespace {

using Eigen::Index, Eigen::MatrixXd, Eigen::VectorXd;

constexpr int most_restarts = 1000;

class Lanczos {
 public:
  Lanczos(const SymmetricOperator& a, const VectorXd& start, Index count, Index space)
      : a_(a), count_(count), basis_(start.size(), space + 1), projected_(MatrixXd::Zero(space, space)) {
    a_(start, next_);
    basis_.col(0) = next_.normalized();
  }

  [[nodiscard]] Eigenpairs solve(double tolerance) {
    for (int restart = 0; restart < most_restarts; ++restart) {
      extend();
      const Eigenpairs ritz = eigenpairs_of_symmetric(projected_.selfadjointView<Eigen::Upper>());
      const VectorXd values = ritz.values.reverse();
      const MatrixXd vectors = ritz.vectors.rowwise().reverse();
      const auto residuals = residual_ * vectors.row(space() - 1).head(count_).cwiseAbs().transpose().array();
      if ((residuals <= tolerance * values.head(count_).array().abs()).all() || space() == basis_.rows())
        return {values.head(count_), basis_.leftCols(space()) * vectors.leftCols(count_)};
      keep(values, vectors);
    }
    return {};
  }

 private:
  [[nodiscard]] Index space() const { return projected_.rows(); }

  /// Adds vectors up to `space` dimensions, and the one after them.
  void extend() {
    for (Index j = kept_; j < space(); ++j) {
      a_(basis_.col(j), next_);
      const double before = next_.norm();
      auto coefficients = projected_.col(j).head(j + 1);
      coefficients.setZero();
      // Only the last two vectors have large coefficients, except after a restart.
      for (Index i = j; i >= std::max(kept_, j - 1); --i) remove(i, coefficients[i]);
      remove_all(coefficients);
      residual_ = next_.norm();
      if (!(residual_ > smallest_share * before)) replace_next(j + 1);
      basis_.col(j + 1) = next_.normalized();
    }
  }

  void remove(Index i, double& coefficient) {
    const double share = basis_.col(i).dot(next_);
    next_ -= share * basis_.col(i);
    coefficient += share;
  }

  /// Gram-Schmidt with all vectors at once; again when much was removed, since rounding errors are relative to that
  /// (Daniel, Gragg, Kaufman and Stewart 1976). Each pass reads the whole basis twice: most of the time of a step.
  void remove_all(Eigen::Ref<VectorXd> coefficients) {
    const auto basis = basis_.leftCols(coefficients.size());
    constexpr int most_passes = 3;
    double before = next_.norm();
    for (int pass = 0; pass < most_passes; ++pass) {
      const VectorXd shares = basis.transpose() * next_;
      next_.noalias() -= basis * shares;
      coefficients += shares;
      const double after = next_.norm();
      if (after > 0.7 * before) return;
      before = after;
    }
  }

  /// The space is invariant: goes on with any vector orthogonal to it.
  void replace_next(Index count) {
    residual_ = 0;
    VectorXd other(basis_.rows());
    for (Index i = 0; i < other.size(); ++i) other[i] = std::sin(static_cast<double>((i + 1) * count));
    a_(other, next_);
    VectorXd unused = VectorXd::Zero(count);
    remove_all(unused);
  }

  /// The best vectors, half of which beyond those wanted, and the one after the whole space.
  void keep(const VectorXd& values, const MatrixXd& vectors) {
    kept_ = count_ + (space() - count_) / 2;
    const MatrixXd best = basis_.leftCols(space()) * vectors.leftCols(kept_);
    basis_.col(kept_) = basis_.col(space());
    basis_.leftCols(kept_) = best;
    projected_.setZero();
    projected_.diagonal().head(kept_) = values.head(kept_);
  }

  static constexpr double smallest_share = 1e-14;  // of a vector: below it, what is left of it is rounding

  const SymmetricOperator& a_;
  Index count_, kept_ = 0;
  MatrixXd basis_;      // n x (space + 1)
  MatrixXd projected_;  // upper triangle of basis' A basis
  VectorXd next_;
  double residual_ = 0;  // norm of what A times the last vector has outside the space
};

}  // namespace

Eigenpairs largest_eigenpairs(const SymmetricOperator& a, const VectorXd& start, Index count, Index space,
                              double tolerance) {
  return Lanczos(a, start, count, space).solve(tolerance);
}

}  // namespace lbea::bake
