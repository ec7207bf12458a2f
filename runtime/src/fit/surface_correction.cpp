#include "runtime/src/fit/surface_correction.hpp"

#include "runtime/src/numbers/elementary.hpp"

#include <cstring>
#include <functional>
#include <numeric>

namespace lbea {
namespace {

using Vector = std::array<float, 3>;

float dot(const Vector& a, const Vector& b) noexcept { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

typedef float Four __attribute__((vector_size(16)));

Four four_at(const float* values) noexcept {
  Four four;
  std::memcpy(&four, values, sizeof(four));
  return four;
}
void put(const Four& four, float* values) noexcept { std::memcpy(values, &four, sizeof(four)); }

/// The plane through points, as their depths along a direction depend on their places across it.
struct Plane {
  Vector center{}, normal{};

  /// With C the covariance, C^-1 d minimizes n' C n for n' d = 1. A small multiple of the identity keeps C regular for
  /// points in a line. sums: by Kernels::sum_moments.
  static Plane through(const std::array<float, 10>& sums, const Vector& direction) noexcept {
    constexpr float regular = 0.01f;
    Plane plane;
    for (std::size_t k = 0; k < 3; ++k) plane.center[k] = sums[1 + k] / sums[0];
    const auto covariance = [&](std::size_t moment, std::size_t k, std::size_t m) {
      return sums[moment] / sums[0] - plane.center[k] * plane.center[m];
    };
    float xx = covariance(4, 0, 0), yy = covariance(7, 1, 1), zz = covariance(9, 2, 2);
    const float xy = covariance(5, 0, 1), xz = covariance(6, 0, 2), yz = covariance(8, 1, 2);
    const float more = regular * (xx + yy + zz);
    xx += more, yy += more, zz += more;
    const Vector adjugate[3] = {{yy * zz - yz * yz, xz * yz - xy * zz, xy * yz - xz * yy},
                                {xz * yz - xy * zz, xx * zz - xz * xz, xy * xz - xx * yz},
                                {xy * yz - xz * yy, xy * xz - xx * yz, xx * yy - xy * xy}};
    for (std::size_t k = 0; k < 3; ++k) plane.normal[k] = dot(adjugate[k], direction);
    const float length = std::sqrt(dot(plane.normal, plane.normal));
    for (float& n : plane.normal) n /= length;
    return plane;
  }
};

Vector cross(const Vector& a, const Vector& b) noexcept {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}

bool set_length_1(Vector& v) noexcept {
  const float length = std::sqrt(dot(v, v));
  if (!(length > 0)) return false;
  for (float& component : v) component /= length;
  return true;
}

/// 0 without values. The time grows with the square of their number.
float median_of_few(std::span<const float> values) noexcept {
  const auto middle = std::ssize(values) / 2;
  for (const float value : values) {
    const auto less = std::ranges::count_if(values, [value](float other) { return other < value; }),
               not_greater = std::ranges::count_if(values, [value](float other) { return other <= value; });
    if (less <= middle && middle < not_greater) return value;
  }
  return 0;
}

/// Where the points end beyond an edge: the second farthest in a strip of the surface, which one wrong point does not
/// change.
class Strip {
 public:
  /// side: along the edge; along: away from it; unit vectors. cell: length unit.
  Strip(const Vector& side, const Vector& along, float cell) noexcept
      : side_(side), along_(along), normal_(cross(side, along)), half_width_(0.35f * cell), thickness_(0.5f * cell) {}
  /// From a place; minus infinity if the strip has fewer points there.
  [[nodiscard]] float end(const CloudIndex& index, const Vector& place) const noexcept {
    constexpr float none = -std::numeric_limits<float>::infinity();
    float farthest = none, second = none;
    std::array<const Leaf*, 8> leaves;
    const std::size_t count = index.find_around(place, leaves);
    for (const Leaf* leaf : std::span(leaves).first(count))
      for (std::size_t i = 0; i < CloudIndex::fanout; ++i) {
        const Vector offset{leaf->x[i] - place[0], leaf->y[i] - place[1], leaf->z[i] - place[2]};
        const bool is_inside =
            std::abs(dot(offset, side_)) < half_width_ && std::abs(dot(offset, normal_)) < thickness_;
        const float length = is_inside ? dot(offset, along_) : none;
        second = std::max(second, std::min(farthest, length));
        farthest = std::max(farthest, length);
      }
    return second;
  }

 private:
  Vector side_, along_, normal_;
  float half_width_, thickness_;
};

/// Of the frame; not a number if the cell is empty or outside the image.
float depth_in(std::size_t cell, const SurfaceCorrection::Observation& seen) noexcept {
  const DepthCamera& camera = seen.camera;
  if (cell >= camera.cells() || seen.depth[cell] < 0) return std::numeric_limits<float>::quiet_NaN();
  return camera.depth_origin + camera.depth_step * seen.depth[cell];
}

}  // namespace

[[gnu::cold]]  // compiled for size
SurfaceCorrection::SurfaceCorrection(const ModelView& model, float mesh_noise, const FitSettings& settings)
    : code_(kernels()),
      price_(settings.prices.correction),
      shift_(settings.correction_shift * mesh_noise),
      strip_(settings.correction_strip * mesh_noise),
      shapes_(model, LandmarkPlaces::surface),
      buffer_(2 * shapes_.size()),
      shape_(shapes_.size()),
      directions_(4 * shapes_.stride()),
      distances_(shapes_.stride()),
      rows_(settings.most_combined() * shapes_.stride()),
      gram_(std::size_t{settings.most_combined()} * settings.most_combined()),
      products_(settings.most_combined()),
      sums_(settings.most_combined()),
      of_nuisances_(nuisances * most_rigs * settings.most_combined()),
      weights_(settings.most_combined()),
      changes_(settings.most_combined()),
      ridge_(settings.most_combined()) {}

void SurfaceCorrection::begin(const ShapeEstimate& estimate) noexcept {
  estimate_ = &estimate;
  samples_ = estimate.samples().size();
  all_measured_ = rigs_ = 0;
  squares_ = distance_squares_ = 0;
  std::ranges::fill(gram_, 0.0f);
  std::ranges::fill(products_, 0.0f);
}

void SurfaceCorrection::add(const Observation& seen) noexcept {
  combine(seen.states);
  measure(seen);
  if (measured_ == 0) return;
  all_measured_ += measured_;
  weigh_robustly();
  own_squares_ = set_rows(seen.states);
  squares_ += own_squares_;
  Nuisances& of_rig = nuisances_[rigs_];
  of_rig.samples = &of_nuisances_[nuisances * rigs_++ * samples_];
  add_products(of_rig);
}

void SurfaceCorrection::join(const SurfaceCorrection& other) noexcept {
  if (other.rigs_ == 0) return;
  all_measured_ += other.all_measured_;
  squares_ += other.squares_;
  distance_squares_ += other.distance_squares_;
  std::ranges::transform(gram_, other.gram_, gram_.begin(), std::plus<>{});
  std::ranges::transform(products_, other.products_, products_.begin(), std::plus<>{});
  nuisances_[rigs_++] = other.nuisances_[0];
}

std::span<const float> SurfaceCorrection::solve(bool may_be_sample) noexcept {
  if (rigs_ == 0) return {};
  // The fewer nodes are measured, the less they tell of the others
  const float nodes = static_cast<float>(shapes_.nodes()), measured = static_cast<float>(all_measured_);
  const float price = price_ * nodes * nodes / measured * (squares_ / static_cast<float>(rigs_));
  if (!(price >= std::numeric_limits<float>::min())) return {};  // all samples have the same shape
  const double rounding = 1e-6 * double{distance_squares_};
  for (Nuisances& of_rig : std::span(nuisances_).first(rigs_)) eliminate(of_rig, price);
  const double left = solve_ridge(price);
  if (!may_be_sample) return weights_by_changes();
  const auto sample = likely_sample(left, price, rounding);
  return sample ? weights_of(*sample) : weights_by_changes();
}

SurfaceEquations SurfaceCorrection::equations() const noexcept {
  return {shape_,   directions_,     distances_, std::span(rows_).first(samples_ * shapes_.stride()),
          samples_, shapes_.nodes(), measured_,  own_squares_};
}

/// Of one of the estimate's samples.
std::span<const float> SurfaceCorrection::shape_of(std::size_t sample, std::span<const StateBetween> states) noexcept {
  if (states.empty()) return shapes_.of(estimate_->numbers()[sample], estimate_->reads_copies(), buffer_);
  const auto& [state, next, share] = states[sample];
  const auto into = std::span(buffer_);
  const auto a = shapes_.of(state, true, into), b = shapes_.of(next, true, into.subspan(shapes_.size()));
  for (std::size_t i = 0; i < shapes_.size(); ++i) buffer_[i] = a[i] + share * (b[i] - a[i]);
  return buffer_;
}

/// Sets the estimate's nodes.
void SurfaceCorrection::combine(std::span<const StateBetween> states) noexcept {
  std::ranges::fill(shape_, 0.0f);
  for (std::size_t k = 0; k < samples_; ++k) {
    const float* const of_sample = shape_of(k, states).data();
    code_.add_multiple(estimate_->samples()[k].weight, of_sample, shape_.size(), shape_.data());
  }
}

void SurfaceCorrection::measure(const Observation& seen) noexcept {
  std::ranges::fill(directions_, 0.0f);
  std::ranges::fill(distances_, 0.0f);
  measured_ = 0;
  const std::size_t edges = shapes_.edges();
  for (std::size_t i = 0; i < shapes_.nodes() - edges; ++i) measure(i, seen);
  for (std::size_t i = 0; i < edges; ++i) measure_edge(i, seen);
}

void SurfaceCorrection::set(std::size_t node, const Vector& direction, float distance) noexcept {
  const std::size_t stride = shapes_.stride();
  for (std::size_t k = 0; k < 3; ++k) directions_[k * stride + node] = direction[k];
  directions_[3 * stride + node] = node < first_edge() ? 0.0f : 1.0f;
  distances_[node] = distance;
  ++measured_;
}

/// Sets the normal and the distance of a node, unless the frame shows no plane near its line of sight.
void SurfaceCorrection::measure(std::size_t node, const Observation& seen) noexcept {
  constexpr float reach = 4, farthest = 2, width = 0.7f;  // in cells: along the line of sight, from a plane, of a plane
  constexpr float fewest = 4;                             // points, weighted
  constexpr float off_center = 0.25f;                     // in widths: the points of an edge lie on one side
  const auto& T = seen.camera.T_reference_sensor;
  Vector sight = vector_at(shape_, shapes_.stride(), node), place = sight;
  for (std::size_t k = 0; k < 3; ++k) sight[k] -= T[4 * k + 3];  // from the eye
  const auto [depth, camera_cell] = seen.camera.place_of(place);
  const float cell = depth / seen.camera.focal, farther = depth_in(camera_cell, seen) - depth;
  if (!(std::abs(farther) < reach * cell)) return;
  for (std::size_t k = 0; k < 3; ++k) place[k] += sight[k] * farther / depth;
  std::array<const Leaf*, 8> leaves;
  const std::size_t count = seen.index.find_around(place, leaves);
  std::array<float, 10> sums;
  code_.sum_moments(leaves.data(), count, place.data(), width * cell, sums.data());
  if (!(sums[0] >= fewest)) return;
  const Plane plane = Plane::through(sums, sight);
  const float along = dot(plane.center, sight),
              across = dot(plane.center, plane.center) - along * along / dot(sight, sight);
  const float distance = dot(plane.normal, plane.center) + dot(plane.normal, sight) * farther / depth;
  if (!(across < square(off_center * width * cell) && std::abs(distance) < farthest * cell)) return;
  set(node, plane.normal, distance);
}

/// Sets the direction and the distance of an edge beside a measured plane, unless no points end near it.
void SurfaceCorrection::measure_edge(std::size_t edge, const Observation& seen) noexcept {
  constexpr float farthest = 1, step = 0.5f, rounding = 1e-3f;  // in cells
  constexpr int most_places = 5;
  const std::size_t node = first_edge() + edge, corner = node - shapes_.edges(), opposite = corner - shapes_.edges();
  const Vector normal = vector_at(directions_, shapes_.stride(), opposite),
               outer = vector_at(shape_, shapes_.stride(), node);
  if (dot(normal, normal) == 0) return;
  const auto& T = seen.camera.T_reference_sensor;
  float depth = 0;
  Vector side = vector_at(shape_, shapes_.stride(), corner), along = outer, place = outer;
  for (std::size_t k = 0; k < 3; ++k) {
    depth += (outer[k] - T[4 * k + 3]) * T[4 * k + 2];
    side[k] = outer[k] - side[k];
    along[k] -= shape_[k * shapes_.stride() + opposite];
    place[k] += distances_[opposite] * normal[k];
  }
  if (!set_length_1(side)) return;
  const float beside = dot(along, side), cell = depth / seen.camera.focal;
  for (std::size_t k = 0; k < 3; ++k) along[k] -= beside * side[k];
  if (!set_length_1(along)) return;
  const Strip strip(side, along, cell);
  float distance = 0;
  for (int i = 0; i < most_places; ++i) {
    Vector there = place;
    for (std::size_t k = 0; k < 3; ++k) there[k] += distance * along[k];
    const float farther = strip.end(seen.index, there);
    const bool is_empty = farther == -std::numeric_limits<float>::infinity();
    distance += is_empty ? -step * cell : farther;
    if (!(std::abs(distance) < farthest * cell)) return;
    if (!is_empty && farther <= rounding * cell) return set(node, along, distance);
  }
}

/// Multiplies the equations by the roots of Cauchy weights: of planes by their distances, of edges by the deviations
/// from their median, because a strip that is missing along all edges is no outlier.
void SurfaceCorrection::weigh_robustly() noexcept {
  constexpr float means = 1.5f, least = std::numeric_limits<float>::min();
  const std::size_t stride = shapes_.stride();
  const float* const is_edge = &directions_[3 * stride];
  std::array<float, most_edge_places> ends;
  std::size_t edges = 0;
  for (std::size_t i = first_edge(); i < shapes_.nodes(); ++i)
    if (is_edge[i] != 0) ends[edges++] = distances_[i];
  const auto measured = std::span(ends).first(edges);
  const float lacking = median_of_few(measured);
  float of_planes = 0, of_edges = 0;
  for (std::size_t i = 0; i < first_edge(); ++i) of_planes += std::abs(distances_[i]);
  for (const float end : measured) of_edges += std::abs(end - lacking);
  of_planes = std::max(means * of_planes / static_cast<float>(std::max<std::size_t>(measured_ - edges, 1)), least);
  of_edges = std::max(means * of_edges / static_cast<float>(std::max<std::size_t>(edges, 1)), of_planes);
  for (std::size_t i = 0; i < stride; ++i) {
    const float deviation = is_edge[i] != 0 ? (distances_[i] - lacking) / of_edges : distances_[i] / of_planes;
    const float root = 1 / std::sqrt(1 + square(deviation));
    distances_[i] *= root;
    for (std::size_t plane = 0; plane < 4; ++plane) directions_[plane * stride + i] *= root;
  }
}

/// Returns the samples' mean squared distance from the estimate.
float SurfaceCorrection::set_rows(std::span<const StateBetween> states) noexcept {
  const std::size_t stride = shapes_.stride();
  Four squares{};
  for (std::size_t s = 0; s < samples_; ++s) {
    const float* const of_sample = shape_of(s, states).data();
    for (std::size_t i = 0; i < stride; i += 4) {
      Four change{};
      for (std::size_t k = i; k < 3 * stride; k += stride) {
        const Four offset = four_at(&of_sample[k]) - four_at(&shape_[k]);
        change += four_at(&directions_[k]) * offset;
        squares += offset * offset;
      }
      put(change, &row(s)[i]);
    }
  }
  return (squares[0] + squares[1] + squares[2] + squares[3]) / static_cast<float>(samples_ * shapes_.nodes());
}

/// Adds the rig's normal equations. The columns of its nuisances are the planes of the directions.
void SurfaceCorrection::add_products(Nuisances& of_rig) noexcept {
  const std::size_t k = samples_, stride = shapes_.stride();
  lbea::add_products(code_, rows_.data(), k, stride, 1, sums_, gram_);
  code_.project(rows_.data(), k, stride, distances_.data(), sums_.data());
  for (std::size_t i = 0; i < k; ++i) products_[i] += sums_[i];
  float squares = 0;
  code_.project(distances_.data(), 1, stride, distances_.data(), &squares);
  distance_squares_ += squares;
  for (std::size_t n = 0; n < nuisances; ++n) {
    const float* const column = &directions_[n * stride];
    code_.project(directions_.data(), nuisances, stride, column, of_rig.matrix[n].data());
    code_.project(column, 1, stride, distances_.data(), &of_rig.constant[n]);
    code_.project(rows_.data(), k, stride, column, &of_rig.samples[n * k]);
  }
}

/// A shift of the whole component is an error of the rig's pose, and a strip that is missing along edges is an error of
/// its measurement. Neither is a deformation, so both are eliminated from the normal equations. A shift of shift_ and a
/// strip of strip_ cost as much as a weight of 1.
void SurfaceCorrection::eliminate(Nuisances& of_rig, float price) noexcept {
  const std::size_t k = samples_;
  auto& [matrix, constant, samples] = of_rig;
  for (std::size_t n = 0; n < nuisances; ++n) matrix[n][n] += price / square(n < 3 ? shift_ : strip_);
  for (std::size_t n = 0; n < nuisances; ++n) {
    const float* const row = &samples[n * k];
    const float pivot = matrix[n][n];
    for (std::size_t i = 0; i < k; ++i) {
      const float factor = row[i] / pivot;
      for (std::size_t j = i; j < k; ++j) gram_[i * k + j] -= factor * row[j];
      products_[i] -= factor * constant[n];
    }
    distance_squares_ -= square(constant[n]) / pivot;
    for (std::size_t other = n + 1; other < nuisances; ++other) {
      const float factor = matrix[other][n] / pivot;
      for (std::size_t m = n; m < nuisances; ++m) matrix[other][m] -= factor * matrix[n][m];
      for (std::size_t i = 0; i < k; ++i) samples[other * k + i] -= factor * row[i];
      constant[other] -= factor * constant[n];
    }
  }
}

/// Sets the changes c of the weights, which minimize |r - R c|^2 + price c'c. Returns the minimum.
double SurfaceCorrection::solve_ridge(float price) noexcept {
  const std::size_t k = samples_;
  const auto changes = std::span(changes_).first(k);
  const auto products = std::span<const float>(products_).first(k);
  std::ranges::copy(products, changes.begin());
  std::ranges::fill(std::span(weights_).first(k), price);
  ridge_.factorize(gram_, k, std::span<const float>(weights_).first(k));
  ridge_.substitute(changes);
  return double{distance_squares_} - std::inner_product(products.begin(), products.end(), changes.begin(), 0.0);
}

/// The sample with the least sum of squares q, if its likelihood is greater than that of all combinations together,
/// whose weights have a normal distribution about the estimate. With n distances, that is if
///   n ln(q / left) < ln det(I + G / price)
/// (Bayesian linear regression, Bishop 2006, eq. 3.86). None if there are no more distances than weights: they do not
/// determine a combination. rounding: of the sums.
[[gnu::cold]]  // compiled for size
std::optional<std::size_t>
SurfaceCorrection::likely_sample(double left, float price, double rounding) const noexcept {
  if (all_measured_ <= samples_) return {};
  const auto squares = [&](std::size_t i) {
    return double{distance_squares_} - 2 * double{products_[i]} + double{gram_[i * samples_ + i]};
  };
  std::size_t sample = 0;
  for (std::size_t i = 1; i < samples_; ++i)
    if (squares(i) < squares(sample)) sample = i;
  const double n = static_cast<double>(all_measured_), least = std::max(rounding, 1e-30),
               ratio = std::max(squares(sample), least) / std::max(left, least);
  if (!(n * logarithm(ratio) < ridge_.log_determinant(samples_, double{price}))) return {};
  return sample;
}

std::span<const float> SurfaceCorrection::weights_of(std::size_t sample) noexcept {
  const auto weights = std::span(weights_).first(samples_);
  std::ranges::fill(weights, 0.0f);
  weights[sample] = 1;
  return weights;
}

/// An estimate with changed weights, whose sum is 1.
std::span<const float> SurfaceCorrection::weights_by_changes() noexcept {
  const auto before = estimate_->samples();
  const auto changes = std::span(changes_).first(before.size());
  const auto weights = std::span(weights_).first(before.size());
  const double all = std::accumulate(changes.begin(), changes.end(), 0.0);
  for (std::size_t i = 0; i < weights.size(); ++i)
    weights[i] = static_cast<float>((1 - all) * double{before[i].weight} + changes[i]);
  return weights;
}

}  // namespace lbea
