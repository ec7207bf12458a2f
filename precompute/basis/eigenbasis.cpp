#include "precompute/basis/eigenbasis.hpp"

#include "precompute/bake_options.hpp"
#include "precompute/basis/lanczos.hpp"

#include <lbea/lbea.hpp>

#include <Eigen/QR>
#include <Eigen/SparseCholesky>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace lbea::bake {
namespace {
using Sparse = Eigen::SparseMatrix<double>;
using Eigen::Index;

constexpr Index dense_below = 300;          // vertices; below, the dense solver is as fast
constexpr double same_eigenvalue = 1e-6;    // relative: closer ones form a cluster, within which the order is arbitrary
constexpr double same_magnitude = 1e-9;     // relative
constexpr double krylov_tolerance = 1e-12;  // of the residual, relative

using Pairs = Eigenpairs;  // ascending

// The symmetric form A q = lambda q has A = M^-1/2 L M^-1/2 and q = M^1/2 psi.
Eigen::SparseMatrix<double> shifted(const Eigen::SparseMatrix<double>& a, double shift) {
  Eigen::SparseMatrix<double> identity(a.rows(), a.cols());
  identity.setIdentity();
  return a - shift * identity;
}

/// (A - sigma I)^-1 restricted to the complement of the columns of `found`.
class ShiftInvert {
 public:
  /// A is kept by reference and must outlive this. sigma < 0 makes A - sigma I positive definite.
  ShiftInvert(const Eigen::SparseMatrix<double>& a, double sigma);

  void operator()(const Eigen::VectorXd& x, Eigen::VectorXd& y) const;

  /// Excludes these eigenvectors (orthonormal columns) from the operator.
  void deflate(Eigen::MatrixXd found) { found_ = std::move(found); }

 private:
  Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor_;
  Eigen::MatrixXd found_;
};

ShiftInvert::ShiftInvert(const Eigen::SparseMatrix<double>& a, double sigma)
    : factor_(shifted(a, sigma)), found_(a.rows(), 0) {
  if (factor_.info() != Eigen::Success)
    throw Error(Status::bad_input,
                "the Laplacian of the region cannot be factorised; are its elements badly distorted?");
}

void ShiftInvert::operator()(const Eigen::VectorXd& x, Eigen::VectorXd& y) const {
  if (found_.cols() == 0) {
    y = factor_.solve(x);
    return;
  }
  y = factor_.solve(x - found_ * (found_.transpose() * x));
  y -= found_ * (found_.transpose() * y).eval();
}

// Weyl's law: a surface of this area has about lambda area / (4 pi) eigenvalues below lambda.
double weyl_spacing(const Eigen::VectorXd& mass) { return 4 * std::numbers::pi / mass.sum(); }

Sparse symmetric_form(const MeshLaplacian& laplacian) {
  const Eigen::VectorXd scale = laplacian.mass.cwiseSqrt().cwiseInverse();
  return scale.asDiagonal() * laplacian.stiffness * scale.asDiagonal();
}

// A fixed start vector (a Weyl sequence): no symmetry of the mesh makes it orthogonal to a mode.
Eigen::VectorXd start_vector(Index n) {
  Eigen::VectorXd start(n);
  for (Index i = 0; i < n; ++i) {
    const double x = static_cast<double>(i + 1) * std::numbers::phi;
    start[i] = x - std::floor(x) - 0.5;
  }
  return start;
}

// The best approximations in the span of `vectors` (Rayleigh-Ritz), the `count` smallest.
Pairs rayleigh_ritz(const Sparse& a, const Eigen::MatrixXd& vectors, Index count) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(vectors);
  const Eigen::MatrixXd q = qr.householderQ() * Eigen::MatrixXd::Identity(vectors.rows(), vectors.cols());
  const Pairs ritz = eigenpairs_of_symmetric(q.transpose() * (a * q));
  const Index kept = std::min(count, vectors.cols());
  return {ritz.values.head(kept), q * ritz.vectors.leftCols(kept)};
}

// The `count` smallest of A - sigma I, from the largest of its inverse.
Pairs krylov_pairs(const ShiftInvert& op, Index n, double sigma, Index count, Index space) {
  Pairs pairs = largest_eigenpairs(std::cref(op), start_vector(n), count,
                                   std::clamp(std::max(2 * count + 1, count + 20), count + 1, space), krylov_tolerance);
  if (pairs.values.size() == 0)
    throw Error(Status::bad_input, "the eigenvalues of the region did not converge; ask for fewer modes");
  pairs.values = sigma + pairs.values.array().inverse();
  return pairs;
}

// How many eigenvalues below the cluster of the last one found were not found.
Index missing(const Sparse& a, const Eigen::VectorXd& values, double floor) {
  Index first_of_cluster = values.size() - 1;
  const auto nearness = [&](double value) { return same_eigenvalue * std::max(std::abs(value), floor); };
  while (first_of_cluster > 0 &&
         values[first_of_cluster] - values[first_of_cluster - 1] < 4 * nearness(values[first_of_cluster]))
    --first_of_cluster;
  const double value = values[first_of_cluster];
  return eigenvalues_below(a, value - nearness(value)) - first_of_cluster;
}

Pairs dense_pairs(const Sparse& a, Index p) {
  const Pairs all = eigenpairs_of_symmetric(Eigen::MatrixXd(a));
  return {all.values.head(p), all.vectors.leftCols(p)};
}

// One Krylov space holds one vector of each eigenspace; several components and symmetric shapes have larger
// eigenspaces. Each round adds missing vectors from the orthogonal complement, at least one of each such space.
Pairs all_pairs(const Sparse& a, Index p, double spacing) {
  const double sigma = -spacing;
  ShiftInvert op(a, sigma);
  Pairs pairs = krylov_pairs(op, a.rows(), sigma, p, a.rows());
  for (Index round = 0; round < p; ++round) {
    const Index lacking = missing(a, pairs.values, spacing);
    if (lacking <= 0) return pairs;
    op.deflate(pairs.vectors);
    const Eigen::MatrixXd more =
        krylov_pairs(op, a.rows(), sigma, std::min(lacking, a.rows() - p - 1), a.rows() - p).vectors;
    Eigen::MatrixXd both(a.rows(), p + more.cols());
    both << pairs.vectors, more;
    pairs = rayleigh_ritz(a, both, p);
  }
  throw Error(Status::bad_input, "some eigenvalues of the region stay out of reach; ask for fewer modes");
}

double residual_of(const Sparse& a, const Pairs& pairs, double spacing) {
  const Eigen::MatrixXd defect = a * pairs.vectors - pairs.vectors * pairs.values.asDiagonal();
  return defect.colwise().norm().maxCoeff() / std::max(pairs.values[pairs.values.size() - 1], spacing);
}

// One step of inverse iteration for each pair. The solvers are exact relative to the largest eigenvalue of A, which
// narrow elements make many orders larger than the smallest ones; the inverse damps what such elements add.
Pairs polished(const Sparse& a, double sigma, const Pairs& pairs) {
  const ShiftInvert inverse(a, sigma);
  Pairs result = pairs;
  Eigen::VectorXd next(a.rows());
  for (Index j = 0; j < pairs.values.size(); ++j) {
    const Eigen::VectorXd mode = pairs.vectors.col(j);
    inverse(mode, next);
    result.values[j] = std::max(sigma + 1 / mode.dot(next), j > 0 ? result.values[j - 1] : sigma);
    result.vectors.col(j) = next.normalized();
  }
  return result;
}

void fix_signs(Eigen::MatrixXd& modes) {
  for (Index j = 0; j < modes.cols(); ++j) {
    const double largest = modes.col(j).cwiseAbs().maxCoeff();
    Index i = 0;
    while (std::abs(modes(i, j)) < (1 - same_magnitude) * largest) ++i;
    if (modes(i, j) < 0) modes.col(j) *= -1;
  }
}

void check_count(std::uint32_t p, Index vertices) {
  if (p == 0 || Index{p} > vertices)
    throw Error(Status::bad_config, std::to_string(p) + " modes asked of a region with " + std::to_string(vertices) +
                                        " vertices; ask for 1 to " + std::to_string(vertices));
}
}  // namespace

Eigen::Index eigenvalues_below(const Eigen::SparseMatrix<double>& a, double shift) {
  const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> factor(shifted(a, shift));
  if (factor.info() != Eigen::Success)
    throw Error(Status::bad_input,
                "the eigenvalues of the region cannot be counted; are its elements badly distorted?");
  return (factor.vectorD().array() < 0).count();
}

Eigenbasis eigenbasis(const MeshLaplacian& laplacian, std::uint32_t p) {
  const Index n = laplacian.mass.size();
  check_count(p, n);
  if (!(laplacian.mass.minCoeff() > 0))
    throw Error(Status::bad_input, "a vertex of the region has no surface around it");
  const Sparse a = symmetric_form(laplacian);
  const double spacing = weyl_spacing(laplacian.mass);
  const bool dense = n <= dense_below || 2 * Index{p} >= n;
  Pairs pairs = dense ? dense_pairs(a, p) : all_pairs(a, p, spacing);

  double residual = residual_of(a, pairs, spacing);
  if (residual > largest_usual_residual) {
    pairs = polished(a, -spacing, pairs);
    residual = residual_of(a, pairs, spacing);
  }
  Eigen::MatrixXd modes = laplacian.mass.cwiseSqrt().cwiseInverse().asDiagonal() * pairs.vectors;
  fix_signs(modes);
  return {pairs.values, std::move(modes), residual, dense ? "dense" : "shift-invert Lanczos, count verified"};
}
}  // namespace lbea::bake
