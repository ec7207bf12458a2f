#include "precompute/dense/symmetric_inverse.hpp"

#include "precompute/dense/block_update.hpp"

#include <algorithm>
#include <vector>

namespace lbea::bake {

#ifdef LBEA_X86_KERNELS
namespace block_update_avx512 {
void update(std::size_t height, std::size_t size, bool is_lower, const double* w, const double* v, double* matrix);
}
namespace block_update_avx2 {
void update(std::size_t height, std::size_t size, bool is_lower, const double* w, const double* v, double* matrix);
}
#endif
namespace block_update_baseline {
void update(std::size_t height, std::size_t size, bool is_lower, const double* w, const double* v, double* matrix);
}

namespace {

constexpr std::size_t block = BlockSizes::sweep;

/// Sweeps row and column k of a symmetric matrix of `block` rows, for all k: leaves minus its inverse.
void sweep(std::vector<double>& matrix) {
  std::vector<double> pivot(block);
  for (std::size_t k = 0; k < block; ++k) {
    const double factor = 1 / matrix[k * block + k];
    std::copy_n(&matrix[k * block], block, pivot.begin());
    for (std::size_t i = 0; i < block; ++i) {
      if (i == k) continue;
      const double share = pivot[i] * factor;
      for (std::size_t j = 0; j < block; ++j) matrix[i * block + j] -= share * pivot[j];
      matrix[i * block + k] = share;
    }
    for (std::size_t j = 0; j < block; ++j) matrix[k * block + j] = pivot[j] * factor;
    matrix[k * block + k] = -factor;
  }
}

/// A symmetric matrix, of which the lower triangle is kept, padded with rows and columns of the identity.
class Swept {
 public:
  explicit Swept(const Eigen::MatrixXd& from)
      : size_((static_cast<std::size_t>(from.rows()) + block - 1) / block * block),
        matrix_(size_ * size_),
        pivot_(block * block),
        beside_(block * size_),
        shares_(block * size_),
        grouped_(block * size_) {
    for (std::size_t i = 0; i < size_; ++i) at(i, i) = 1;
    for (Eigen::Index i = 0; i < from.rows(); ++i)
      std::copy_n(from.col(i).data(), i + 1, &at(static_cast<std::size_t>(i), 0));
  }

  /// A_ij -= A_ik A_kk^-1 A_kj beside block k, there A_ik A_kk^-1, and -A_kk^-1 in the block itself: after all blocks,
  /// minus the inverse.
  void sweep_all() {
    const BlockUpdate update = block_updates()[0];
    for (std::size_t first = 0; first < size_; first += block) {
      copy_pivot(first);
      copy_beside(first);
      std::ranges::fill(shares_, 0.0);
      update(block, size_, false, grouped(pivot_, block), beside_.data(), shares_.data());
      update(size_, size_, true, grouped(shares_, size_), beside_.data(), matrix_.data());
      write_back(first);
    }
  }

  [[nodiscard]] Eigen::MatrixXd minus_upper_left(Eigen::Index n) const {
    Eigen::MatrixXd result(n, n);
    for (Eigen::Index i = 0; i < n; ++i)
      for (Eigen::Index j = 0; j <= i; ++j)
        result(j, i) = -matrix_[static_cast<std::size_t>(i) * size_ + static_cast<std::size_t>(j)];
    result.triangularView<Eigen::StrictlyLower>() = result.transpose();
    return result;
  }

 private:
  double& at(std::size_t row, std::size_t column) { return matrix_[row * size_ + column]; }

  void copy_pivot(std::size_t first) {
    for (std::size_t i = 0; i < block; ++i)
      for (std::size_t j = 0; j <= i; ++j) pivot_[i * block + j] = pivot_[j * block + i] = at(first + i, first + j);
    sweep(pivot_);
  }

  /// A_kj, without the pivot.
  void copy_beside(std::size_t first) {
    for (std::size_t k = 0; k < block; ++k) {
      std::copy_n(&at(first + k, 0), first, &beside_[k * size_]);
      std::fill_n(&beside_[k * size_ + first], block, 0.0);
    }
    for (std::size_t j = first + block; j < size_; ++j)
      for (std::size_t k = 0; k < block; ++k) beside_[k * size_ + j] = at(j, first + k);
  }

  /// The transpose of a matrix of `block` rows, as BlockUpdate takes it.
  const double* grouped(const std::vector<double>& matrix, std::size_t columns) {
    constexpr std::size_t rows = BlockSizes::rows;
    for (std::size_t i = 0; i < columns; i += rows)
      for (std::size_t k = 0; k < block; ++k)
        std::copy_n(&matrix[k * columns + i], rows, &grouped_[i * block + k * rows]);
    return grouped_.data();
  }

  void write_back(std::size_t first) {
    for (std::size_t k = 0; k < block; ++k) {
      std::copy_n(&shares_[k * size_], first, &at(first + k, 0));
      std::copy_n(&pivot_[k * block], k + 1, &at(first + k, first));
    }
    for (std::size_t i = first + block; i < size_; ++i)
      for (std::size_t k = 0; k < block; ++k) at(i, first + k) = shares_[k * size_ + i];
  }

  std::size_t size_;
  std::vector<double> matrix_, pivot_;
  std::vector<double> beside_, shares_;  // block x size: A_kj, A_kk^-1 A_kj
  std::vector<double> grouped_;
};

}  // namespace

const BlockUpdate* block_updates() noexcept {
  struct Choice {
    BlockUpdate found[4]{};
    Choice() noexcept {
      std::size_t count = 0;
#ifdef LBEA_X86_KERNELS
      if (__builtin_cpu_supports("avx512f")) found[count++] = block_update_avx512::update;
      if (__builtin_cpu_supports("avx2")) found[count++] = block_update_avx2::update;
#endif
      found[count] = block_update_baseline::update;
    }
  };
  static const Choice choice;
  return choice.found;
}

Eigen::MatrixXd inverse_of_symmetric(const Eigen::MatrixXd& matrix) {
  Swept swept(matrix);
  swept.sweep_all();
  return swept.minus_upper_left(matrix.rows());
}

}  // namespace lbea::bake
