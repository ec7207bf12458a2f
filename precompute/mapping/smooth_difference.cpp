#include "precompute/mapping/smooth_difference.hpp"

#include <algorithm>
#include <cmath>

namespace lbea::bake {
namespace {
constexpr std::size_t most_places = 2000;  // of the fit, which has 105 unknowns
constexpr int iterations = 8;
constexpr double reach_diagonals = 0.05;  // of the component's diagonal; what differs by more is no variant of it
// Penalties of the squares of a coefficient and of a displacement that an iteration adds, relative to those of
// distances along normals: where there is evidence, the iterations add up to what is needed, and elsewhere nearly
// nothing is added.
constexpr double resistance = 3e-4, resistance_of_motion = 3e-2;
constexpr double worthwhile = 0.8;  // the distances must fall to this share
constexpr double rounding = 1e-6;   // of the diagonal

std::vector<WantedPlace> some_nodes(const ReferencePlaces& reference) {
  std::vector<std::uint32_t> nodes;
  for (std::uint32_t node = 0; node < reference.mesh().nodes(); ++node)
    if (reference.has_node(node)) nodes.push_back(node);
  const std::size_t count = std::min(nodes.size(), most_places);
  std::vector<WantedPlace> some;
  for (std::size_t i = 0; i < count; ++i) some.push_back(reference.node(nodes[i * nodes.size() / count]));
  return some;
}

double distance(const std::array<double, 3>& a, const std::array<double, 3>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

double mean_left(const auto& evidence) {
  double sum = 0;
  for (const auto& e : evidence) sum += std::abs(e.left);
  return evidence.empty() ? 0 : sum / static_cast<double>(evidence.size());
}
}  // namespace

SmoothDifference::SmoothDifference(const ReferencePlaces& reference, const PartSurfaces& run)
    : middle_(reference.middle()), scale_(reference.diagonal() / 2), reach_(reach_diagonals * reference.diagonal()) {
  const std::vector<WantedPlace> places = some_nodes(reference);
  std::vector<Evidence> found = evidence(run, places);
  const double before = mean_left(found);
  if (!(before > rounding * reference.diagonal())) return;
  is_zero_ = false;
  for (int i = 0; i < iterations && !found.empty(); ++i) {
    fit(found);
    found = evidence(run, places);
  }
  // A motion within a face leaves no distance: large differences fit well, but put nodes on other points of the face.
  const auto is_near = [&](const WantedPlace& place) { return distance(place.point, moved(place.point)) <= reach_; };
  if (mean_left(found) < worthwhile * before && std::ranges::all_of(places, is_near)) return;
  is_zero_ = true;
  coefficients_.setZero();
}

std::array<double, 3> SmoothDifference::moved(const std::array<double, 3>& point) const noexcept {
  if (is_zero_) return point;
  const Eigen::Vector3d by = coefficients_.transpose() * terms_at(point);
  return {point[0] + by[0], point[1] + by[1], point[2] + by[2]};
}

WantedPlace SmoothDifference::moved(WantedPlace wanted) const noexcept {
  wanted.point = moved(wanted.point);
  return wanted;
}

SmoothDifference::Terms SmoothDifference::terms_at(const std::array<double, 3>& point) const noexcept {
  std::array<std::array<double, 5>, 3> powers{};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    powers[axis][0] = 1;
    for (std::size_t i = 1; i < 5; ++i) powers[axis][i] = powers[axis][i - 1] * (point[axis] - middle_[axis]) / scale_;
  }
  Terms result;
  int next = 0;
  for (std::size_t x = 0; x < 5; ++x)
    for (std::size_t y = 0; x + y < 5; ++y)
      for (std::size_t z = 0; x + y + z < 5; ++z) result[next++] = powers[0][x] * powers[1][y] * powers[2][z];
  return result;
}

std::vector<SmoothDifference::Evidence> SmoothDifference::evidence(const PartSurfaces& run,
                                                                   std::span<const WantedPlace> places) const {
  std::vector<Evidence> found;
  for (const WantedPlace& wanted : places) {
    const WantedPlace there = moved(wanted);
    const SurfacePlace place = run.nearest(there, reach_);
    if (!place.found()) continue;
    const Eigen::Vector3d normal = Eigen::Map<const Eigen::Vector3d>(place.normal.data());
    const double left = normal.dot(Eigen::Map<const Eigen::Vector3d>(place.position.data()) -
                                   Eigen::Map<const Eigen::Vector3d>(there.point.data()));
    found.push_back({terms_at(wanted.point), normal, left});
  }
  return found;
}

// Adds to the coefficients. Places that are much farther than most, as on a bead that only one of the shapes has, count
// less.
void SmoothDifference::fit(const std::vector<Evidence>& evidence) {
  const double usual = std::max(3 * mean_left(evidence), rounding * scale_);
  Eigen::MatrixXd matrix =
      Eigen::MatrixXd::Identity(3 * terms, 3 * terms) * (resistance * static_cast<double>(evidence.size()));
  Eigen::VectorXd right = Eigen::VectorXd::Zero(3 * terms);
  for (const Evidence& e : evidence) {
    const double weight = 1 / (1 + e.left * e.left / (usual * usual));
    const Eigen::Matrix<double, terms, terms> squares = weight * e.terms * e.terms.transpose();
    for (int i = 0; i < 3; ++i) {
      right.segment<terms>(terms * i) += weight * e.left * e.normal[i] * e.terms;
      for (int j = 0; j < 3; ++j)
        matrix.block<terms, terms>(terms * i, terms * j) +=
            (e.normal[i] * e.normal[j] + (i == j ? resistance_of_motion : 0)) * squares;
    }
  }
  const Eigen::VectorXd solution = matrix.ldlt().solve(right);
  coefficients_ += Eigen::Map<const Eigen::Matrix<double, terms, 3>>(solution.data());
}
}  // namespace lbea::bake
