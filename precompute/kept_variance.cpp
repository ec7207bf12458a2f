#include "precompute/kept_variance.hpp"

#include <algorithm>

namespace lbea {

namespace {

double squared_in(const Eigen::VectorXd& mass, const Eigen::MatrixXd& f) {
  return mass.dot(f.rowwise().squaredNorm());
}

void add_to(Eigen::MatrixXd& sum, const Eigen::MatrixXd& term) {
  if (sum.size() == 0)
    sum = term;
  else
    sum += term;
}

}  // namespace

void Moments::add(const Eigen::VectorXd& mass, const Eigen::MatrixXd& positions,
                  const Eigen::MatrixXd& coefficients) {
  samples += 1;
  squared_positions += squared_in(mass, positions);
  squared_coefficients += coefficients.squaredNorm();
  add_to(sum_positions, positions);
  add_to(sum_coefficients, coefficients);
}

void Moments::add(const Moments& other) {
  samples += other.samples;
  squared_positions += other.squared_positions;
  squared_coefficients += other.squared_coefficients;
  add_to(sum_positions, other.sum_positions);
  add_to(sum_coefficients, other.sum_coefficients);
}

double Moments::total(const Eigen::VectorXd& mass) const {
  return std::max(squared_positions - squared_in(mass, sum_positions) / samples, 0.0);
}

double Moments::kept() const {
  return std::max(squared_coefficients - sum_coefficients.squaredNorm() / samples, 0.0);
}

void MomentsInOrder::add(std::size_t run, std::vector<Moments> of_run) {
  const std::lock_guard lock(mutex_);
  if (waiting_.size() <= run) waiting_.resize(run + 1);
  waiting_[run] = std::move(of_run);
  for (; next_ < waiting_.size() && waiting_[next_]; ++next_) {
    for (std::size_t reference = 0; reference < sum_.size(); ++reference)
      sum_[reference].add((*waiting_[next_])[reference]);
    waiting_[next_].reset();
  }
}

}  // namespace lbea
