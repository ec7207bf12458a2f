#include "tools/bench/answer.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numeric>

namespace lbea::tool::bench {
namespace {

constexpr double u = float_rounding;
constexpr double root_3 = 1.7320509;
constexpr std::size_t summing_lanes = 16;

using Finding = std::optional<std::string>;

template <typename... Values>
Finding found(const char* pattern, Values... values) {
  std::array<char, 256> line{};
  std::snprintf(line.data(), line.size(), pattern, values...);
  return line.data();
}

Finding wrong_coefficient(const ReferenceView& reference, const PlainCloud& cloud, const Answer& answer) {
  const std::size_t n = answer.points.size(), p = reference.eigenvalues.size(), stride = format::padded(n);
  if (answer.coefficients.size() != 3 * p)
    return found("%zu coefficients for %zu modes", answer.coefficients.size(), p);
  const double roundings = static_cast<double>(n / summing_lanes + summing_lanes);
  for (std::size_t j = 0; j < p; ++j)
    for (std::size_t axis = 0; axis < 3; ++axis) {
      double sum = 0, error = 0;
      for (std::size_t i = 0; i < n; ++i) {
        const double weight = reference.projection[j * stride + i], f = cloud.positions[answer.points[i]][axis];
        sum += weight * f;
        error += std::abs(weight) * (cloud.position_error + roundings * u * std::abs(f));
      }
      const double here = answer.coefficients[3 * j + axis];
      if (!(std::abs(here - sum) <= error))
        return found("mode %zu, coordinate %zu: coefficient %.9g, should be %.9g", j, axis, here, sum);
    }
  return {};
}

// Eq. 3 from the answer's own coefficients.
std::vector<double> lbea_distances(const ReferenceView& reference, const Answer& answer) {
  const std::size_t p = reference.eigenvalues.size(), stride = format::padded(p);
  std::vector<double> distances(reference.coefficients.size() / (3 * stride));
  for (std::size_t s = 0; s < distances.size(); ++s)
    for (std::size_t j = 0; j < p; ++j) {
      const float* sample = reference.coefficients.data() + 3 * stride * s + j;
      const float* e = answer.coefficients.data() + 3 * j;
      distances[s] += distance({e[0], e[1], e[2]}, {sample[0], sample[stride], sample[2 * stride]});
    }
  return distances;
}

// Eq. 1 over n, from the answer's own nearest points.
std::vector<double> vtp_distances(const ModelView& model, const ReferenceView& reference, const PlainCloud& cloud,
                                  const Answer& answer) {
  const std::size_t n = answer.points.size();
  std::vector<double> distances(model.info.samples);
  for (std::size_t s = 0; s < distances.size(); ++s) {
    for (std::size_t i = 0; i < n; ++i) {
      const float* node =
          model.node_positions.data() + 3 * (s * model.info.nodes + reference.correspondence[s * n + i]);
      distances[s] += distance(cloud.positions[answer.points[i]], {node[0], node[1], node[2]});
    }
    distances[s] /= static_cast<double>(n);
  }
  return distances;
}

struct Tolerance {
  double absolute, relative;
  [[nodiscard]] double of(double distance) const { return absolute + relative * distance; }
};

Tolerance tolerance_of(const Question& question, const PlainCloud& cloud) {
  constexpr double norm_and_mean = 16;  // roundings of one norm, and of what is done to the sum
  const double terms = question.method == Method::lbea ? question.model.info.modes : question.model.info.vertices;
  return {question.method == Method::lbea ? 0 : root_3 * cloud.position_error, (terms + norm_and_mean) * u};
}

Finding wrong_ranking(const std::vector<RankedSample>& ranked, const std::vector<double>& distances,
                      std::size_t matches, Tolerance tolerance) {
  const std::size_t expected = std::min(matches, distances.size());
  if (ranked.size() != expected) return found("%zu samples ranked, should be %zu", ranked.size(), expected);
  std::vector<double> ascending = distances;
  std::ranges::sort(ascending);
  for (std::size_t k = 0; k < expected; ++k) {
    const auto [sample, claimed] = ranked[k];
    if (sample >= distances.size()) return found("place %zu: sample %u is not in the model", k + 1, sample);
    for (std::size_t before = 0; before < k; ++before)
      if (ranked[before].sample == sample) return found("place %zu: sample %u is ranked twice", k + 1, sample);
    const double actual = distances[sample];
    if (!(std::abs(double{claimed} - actual) <= tolerance.of(actual)))
      return found("place %zu: sample %u is said to be at %.9g, is at %.9g", k + 1, sample, double{claimed}, actual);
    if (actual > ascending[k] + 2 * tolerance.of(actual))
      return found("place %zu: sample %u is at %.9g, another one at %.9g", k + 1, sample, actual, ascending[k]);
  }
  return {};
}

}  // namespace

Judge::Judge(const Question& question, std::span<const Point> points)
    : question_(question),
      cloud_(points, question.T_reference_sensor, question.model.envelope),
      least_(question.model.references.size()) {}

const std::vector<double>& Judge::least_distances(std::uint32_t reference) {
  if (least_[reference].empty())
    least_[reference] = nearest_distances(cloud_, question_.model.references[reference].vertex_positions);
  return least_[reference];
}

Finding Judge::wrong_nearest(const Answer& answer) {
  const auto vertices = question_.model.references[answer.reference].vertex_positions;
  if (answer.points.size() != vertices.size())
    return found("%zu nearest points for %zu vertices", answer.points.size(), vertices.size());
  const std::vector<double>& least = least_distances(answer.reference);
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const std::uint32_t point = answer.points[v];
    if (point >= cloud_.positions.size()) return found("vertex %zu: point %u is not in the frame", v, point);
    if (cloud_.membership[point] == Membership::outside)
      return found("vertex %zu: point %u is outside the ensemble's envelope", v, point);
    const auto& [x, y, z] = vertices[v];
    const double here = distance(cloud_.positions[point], {x, y, z});
    // Both distances carry the error of a position, and of a difference, three squares, sums and a root.
    if (here > least[v] + 2 * (root_3 * cloud_.position_error + 4 * u * least[v]))
      return found("vertex %zu: point %u lies at %.6g, the nearest at %.6g", v, point, here, least[v]);
  }
  return {};
}

Finding Judge::disagreement(const Answer& answer) {
  if (answer.reference >= least_.size()) return found("reference %u is not in the model", answer.reference);
  const ReferenceView& reference = question_.model.references[answer.reference];
  if (Finding wrong = wrong_nearest(answer)) return wrong;
  if (Finding wrong = wrong_coefficient(reference, cloud_, answer)) return wrong;
  const std::vector<double> distances = question_.method == Method::lbea
                                            ? lbea_distances(reference, answer)
                                            : vtp_distances(question_.model, reference, cloud_, answer);
  return wrong_ranking(answer.ranked, distances, question_.matches, tolerance_of(question_, cloud_));
}

}  // namespace lbea::tool::bench
