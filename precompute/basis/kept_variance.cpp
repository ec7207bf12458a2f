#include "precompute/basis/kept_variance.hpp"

#include <algorithm>
#include <numeric>
#include <vector>

namespace lbea::bake {
namespace {

double squared_in(const Eigen::VectorXd& mass, const Eigen::MatrixXd& f) { return mass.dot(f.rowwise().squaredNorm()); }

void add_to(Eigen::MatrixXd& sum, const Eigen::MatrixXd& term) {
  if (sum.size() == 0)
    sum = term;
  else
    sum += term;
}

}  // namespace

void Moments::add(const Eigen::VectorXd& mass, const Eigen::MatrixXd& positions, const Eigen::MatrixXd& coefficients) {
  samples += 1;
  squared_positions += squared_in(mass, positions);
  squared_coefficients += coefficients.squaredNorm();
  add_to(sum_positions, positions);
  add_to(sum_coefficients, coefficients);
  add_to(sum_squares, coefficients.cwiseAbs2());
}

void Moments::add(const Moments& other) {
  samples += other.samples;
  squared_positions += other.squared_positions;
  squared_coefficients += other.squared_coefficients;
  add_to(sum_positions, other.sum_positions);
  add_to(sum_coefficients, other.sum_coefficients);
  add_to(sum_squares, other.sum_squares);
}

double Moments::total(const Eigen::VectorXd& mass) const {
  return std::max(squared_positions - squared_in(mass, sum_positions) / samples, 0.0);
}

double Moments::kept() const { return std::max(squared_coefficients - sum_coefficients.squaredNorm() / samples, 0.0); }

std::array<std::uint32_t, 3> Moments::leading_axes() const {
  const Eigen::MatrixXd variance = sum_squares - sum_coefficients.cwiseAbs2() / samples;
  std::vector<std::uint32_t> places(static_cast<std::size_t>(variance.size()));
  std::iota(places.begin(), places.end(), 0u);
  const auto at = [&](std::uint32_t place) { return variance(place / 3, place % 3); };
  std::ranges::stable_sort(places, std::ranges::greater{}, at);
  return {places[0], places[std::min<std::size_t>(1, places.size() - 1)],
          places[std::min<std::size_t>(2, places.size() - 1)]};
}

}  // namespace lbea::bake
