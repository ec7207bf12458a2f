#include "tools/bench/answer.hpp"

#include "tools/shared/text/formatted.hpp"

namespace lbea::tool::bench {
namespace {

constexpr double root_3 = 1.7320509;
constexpr double infinity = std::numeric_limits<double>::infinity();

double row(std::span<const float, 4> T, const Point& p) {
  return double{T[0]} * double{p.x} + double{T[1]} * double{p.y} + double{T[2]} * double{p.z} + double{T[3]};
}

// The largest absolute coordinate in the envelope.
double extent_of(const EnvelopeView& envelope) {
  double extent = 0;
  for (std::size_t axis = 0; axis < 3; ++axis)
    extent = std::max(extent, std::abs(double{envelope.corner[axis]}) + double{envelope.cell} * envelope.cells[axis]);
  return extent;
}

// For a point in the envelope: |p| = |R p| <= sqrt(3) (extent + |t|), and each row of R has length 1.
double largest_term_sum(const RigidTransform& T, double extent) {
  const double translation = std::max({std::abs(T[3]), std::abs(T[7]), std::abs(T[11])});
  return root_3 * (extent + root_3 * translation) + translation;
}

bool holds(const EnvelopeView& envelope, const std::array<double, 3>& cell) {
  std::size_t place = 0;
  for (std::size_t axis = 3; axis-- > 0;) {
    if (!(cell[axis] >= 0) || !(cell[axis] < envelope.cells[axis])) return false;
    place = place * envelope.cells[axis] + static_cast<std::size_t>(cell[axis]);
  }
  return (envelope.bits[place / 64] >> (place % 64) & 1u) != 0;
}

// Tests the corners of the box of all positions that the point may have been rounded to.
Membership membership_of(const Position& position, const EnvelopeView& envelope, double error) {
  std::size_t held = 0;
  for (unsigned corner = 0; corner < 8; ++corner) {
    std::array<double, 3> cell{};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double moved = position[axis] + ((corner >> axis & 1u) != 0 ? error : -error);
      cell[axis] = std::floor((moved - double{envelope.corner[axis]}) / double{envelope.cell});
    }
    held += holds(envelope, cell);
  }
  return held == 8 ? Membership::inside : held == 0 ? Membership::outside : Membership::boundary;
}

constexpr double u = float_rounding;
constexpr std::size_t summing_lanes = 16;

Mismatch wrong_coefficient(const ReferenceView& reference, const ReferenceCloud& cloud, const Answer& answer) {
  const std::size_t n = answer.points.size(), p = reference.eigenvalues.size(), stride = format::padded(n);
  if (answer.coefficients.size() != 3 * p)
    return formatted("%zu coefficients for %zu modes", answer.coefficients.size(), p);
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
        return formatted("mode %zu, coordinate %zu: coefficient %.9g, should be %.9g", j, axis, here, sum);
    }
  return {};
}

// Eq. 3 with the coefficients of the answer.
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

// Eq. 1 divided by n, with the nearest points of the answer.
std::vector<double> vtp_distances(const ModelView& model, const ReferenceView& reference, const ReferenceCloud& cloud,
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

Tolerance tolerance_of(const MatchTask& task, const ReferenceCloud& cloud) {
  constexpr double norm_and_mean = 16;  // roundings of one norm and of the mean
  if (task.method != Method::vtp) return {0, (task.model.info.modes + norm_and_mean) * u};
  return {root_3 * cloud.position_error, (task.model.info.vertices + norm_and_mean) * u};
}

}  // namespace

Mismatch wrong_ranking(std::span<const RankedSample> ranked, std::span<const double> distances, std::size_t matches,
                       Tolerance tolerance) {
  const std::size_t expected = std::min(matches, distances.size());
  if (ranked.size() != expected) return formatted("%zu samples ranked, should be %zu", ranked.size(), expected);
  std::vector<double> ascending(distances.begin(), distances.end());
  std::ranges::sort(ascending);
  for (std::size_t k = 0; k < expected; ++k) {
    const auto [sample, claimed] = ranked[k];
    if (sample >= distances.size()) return formatted("place %zu: sample %u is not in the model", k + 1, sample);
    for (std::size_t before = 0; before < k; ++before)
      if (ranked[before].sample == sample) return formatted("place %zu: sample %u is ranked twice", k + 1, sample);
    const double actual = distances[sample];
    if (!(std::abs(double{claimed} - actual) <= tolerance.of(actual)))
      return formatted("place %zu: sample %u has distance %.9g, should be %.9g", k + 1, sample, double{claimed},
                       actual);
    if (actual > (1 + tolerance.missed) * ascending[k] + 2 * tolerance.of(actual))
      return formatted("place %zu: sample %u has distance %.9g, another sample %.9g", k + 1, sample, actual,
                       ascending[k]);
  }
  return {};
}

ReferenceCloud::ReferenceCloud(std::span<const Point> points, const RigidTransform& T, const EnvelopeView& envelope)
    : positions(points.size()), membership(points.size(), Membership::outside) {
  constexpr double roundings = 4;  // of a product and its three sums
  const double extent = extent_of(envelope);
  position_error = roundings * float_rounding * largest_term_sum(T, extent);
  const double cell_error = 2 * position_error + 4 * float_rounding * extent;
  for (std::size_t i = 0; i < points.size(); ++i) {
    for (std::size_t axis = 0; axis < 3; ++axis)
      positions[i][axis] = row(std::span(T).subspan(4 * axis).first<4>(), points[i]);
    membership[i] = membership_of(positions[i], envelope, cell_error);
  }
}

double distance(const Position& a, const Position& b) noexcept {
  const double x = a[0] - b[0], y = a[1] - b[1], z = a[2] - b[2];
  return std::sqrt(x * x + y * y + z * z);
}

// Four vertices at a time, so that their minima are independent and the processor computes them in parallel.
std::vector<double> nearest_distances(const ReferenceCloud& cloud, std::span<const std::array<float, 3>> vertices) {
  constexpr std::size_t width = 4;
  std::vector<Position> inside;
  for (std::size_t i = 0; i < cloud.positions.size(); ++i)
    if (cloud.membership[i] == Membership::inside) inside.push_back(cloud.positions[i]);
  std::vector<double> distances(vertices.size());
  for (std::size_t begin = 0; begin < vertices.size(); begin += width) {
    double q[width][3], least[width];
    for (std::size_t k = 0; k < width; ++k) {
      const auto& vertex = vertices[std::min(begin + k, vertices.size() - 1)];
      for (std::size_t axis = 0; axis < 3; ++axis) q[k][axis] = vertex[axis];
      least[k] = infinity;
    }
    for (const auto& [px, py, pz] : inside)
      for (std::size_t k = 0; k < width; ++k) {
        const double x = px - q[k][0], y = py - q[k][1], z = pz - q[k][2], squared = x * x + y * y + z * z;
        least[k] = squared < least[k] ? squared : least[k];
      }
    for (std::size_t k = 0; k < width && begin + k < vertices.size(); ++k) distances[begin + k] = std::sqrt(least[k]);
  }
  return distances;
}

AnswerCheck::AnswerCheck(const MatchTask& task, std::span<const Point> points)
    : task_(task), cloud_(points, task.T_reference_sensor, task.model.envelope), least_(task.model.references.size()) {}

const std::vector<double>& AnswerCheck::least_distances(std::uint32_t reference) {
  if (least_[reference].empty())
    least_[reference] = nearest_distances(cloud_, task_.model.references[reference].vertex_positions);
  return least_[reference];
}

Mismatch AnswerCheck::wrong_nearest(const Answer& answer) {
  const auto vertices = task_.model.references[answer.reference].vertex_positions;
  if (answer.points.size() != vertices.size())
    return formatted("%zu nearest points for %zu vertices", answer.points.size(), vertices.size());
  const std::vector<double>& least = least_distances(answer.reference);
  std::size_t farther = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const std::uint32_t point = answer.points[v];
    if (point >= cloud_.positions.size()) return formatted("vertex %zu: point %u is not in the frame", v, point);
    if (cloud_.membership[point] == Membership::outside)
      return formatted("vertex %zu: point %u is outside the ensemble's envelope", v, point);
    const auto& [x, y, z] = vertices[v];
    const double here = distance(cloud_.positions[point], {x, y, z});
    // Error of both distances: of a position, and of a difference, three squares, sums and a root.
    if (here > least[v] + 2 * (root_3 * cloud_.position_error + 4 * u * least[v]) && ++farther > answer.cut)
      return formatted("vertex %zu: point %u has distance %.6g, the nearest %.6g", v, point, here, least[v]);
  }
  return {};
}

Mismatch AnswerCheck::disagreement(const Answer& answer) {
  if (answer.reference >= least_.size()) return formatted("reference %u is not in the model", answer.reference);
  const ReferenceView& reference = task_.model.references[answer.reference];
  if (Mismatch wrong = wrong_nearest(answer)) return wrong;
  if (Mismatch wrong = wrong_coefficient(reference, cloud_, answer)) return wrong;
  const std::vector<double> distances = task_.method == Method::vtp
                                            ? vtp_distances(task_.model, reference, cloud_, answer)
                                            : lbea_distances(reference, answer);
  const std::size_t matches = answer.fit ? std::max<std::size_t>(task_.matches, task_.proposals) : task_.matches;
  return wrong_ranking(answer.ranked, distances, matches, tolerance_of(task_, cloud_));
}

}  // namespace lbea::tool::bench
