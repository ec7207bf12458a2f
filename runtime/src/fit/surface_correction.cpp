#include "runtime/src/fit/surface_correction.hpp"

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

/// Weighted sums over points near a place, relative to it: of weights; x, y, z; xx, xy, xz, yy, yz, zz.
class Moments {
 public:
  Moments(const Vector& place, float reach) noexcept : place_(place), per_square_(1 / square(reach)) {}
  void add(const Leaf& leaf) noexcept {
    for (std::size_t i = 0; i < CloudIndex::fanout; i += 4) {
      const Four x = four_at(&leaf.x[i]) - place_[0], y = four_at(&leaf.y[i]) - place_[1],
                 z = four_at(&leaf.z[i]) - place_[2];
      const Four weight = 1 - per_square_ * (x * x + y * y + z * z), none{};
      const auto is_near = weight > none;
      const Four w = is_near ? weight : none, wx = w * (is_near ? x : none), wy = w * (is_near ? y : none),
                 wz = w * (is_near ? z : none);
      const Four terms[] = {w, wx, wy, wz, wx * x, wx * y, wx * z, wy * y, wy * z, wz * z};
      for (std::size_t moment = 0; moment < 4; ++moment) sums_[moment] += terms[moment];
      for (std::size_t moment = 4; moment < 10; ++moment) sums_[moment] += is_near ? terms[moment] : none;
    }
  }
  [[nodiscard]] std::array<float, 10> sums() const noexcept {
    std::array<float, 10> sums;
    for (std::size_t moment = 0; moment < sums.size(); ++moment) {
      const Four& of = sums_[moment];
      sums[moment] = (of[0] + of[1]) + (of[2] + of[3]);
    }
    return sums;
  }

 private:
  Vector place_;
  float per_square_;
  std::array<Four, 10> sums_{};
};

/// The plane through points, as their depths along a direction depend on their places across it.
struct Plane {
  Vector center{}, normal{};

  /// With C the covariance, C^-1 d minimizes n' C n for n' d = 1. A small multiple of the identity keeps C regular for
  /// points in a line.
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

/// Of the frame, in the cell of a line of sight; not a number if that is empty.
float depth_at(const Vector& sight, float depth, const SurfaceCorrection::Observation& seen) noexcept {
  constexpr float none = std::numeric_limits<float>::quiet_NaN();
  const DepthCamera& camera = seen.camera;
  const auto& T = camera.T_reference_sensor;
  const float column = camera.center_column + camera.focal * dot(sight, {T[0], T[4], T[8]}) / depth,
              row = camera.center_row + camera.focal * dot(sight, {T[1], T[5], T[9]}) / depth;
  if (!(depth > 0 && column >= 0 && column < static_cast<float>(camera.columns) && row >= 0 &&
        row < static_cast<float>(camera.rows)))
    return none;
  const float steps = seen.depth[static_cast<std::size_t>(row) * camera.columns + static_cast<std::size_t>(column)];
  return steps < 0 ? none : camera.depth_origin + camera.depth_step * steps;
}

}  // namespace

[[gnu::cold]]  // compiled for size
SurfaceCorrection::SurfaceCorrection(const ModelView& model, float mesh_noise, const FitSettings& settings)
    : code_(kernels()),
      price_(settings.correction_price),
      shift_(settings.correction_shift * mesh_noise),
      shapes_(model, LandmarkPlaces::surface),
      buffer_(2 * shapes_.size()),
      shape_(shapes_.size()),
      normals_(shapes_.size()),
      distances_(shapes_.stride()),
      rows_(settings.most_combined() * shapes_.stride()),
      gram_(std::size_t{settings.most_combined()} * settings.most_combined()),
      products_(settings.most_combined()),
      sums_(settings.most_combined()),
      of_shifts_(3 * most_rigs * settings.most_combined()),
      weights_(settings.most_combined()),
      changes_(settings.most_combined()),
      ridge_(settings.most_combined()) {}

void SurfaceCorrection::begin(const ShapeEstimate& estimate) noexcept {
  estimate_ = &estimate;
  all_measured_ = rigs_ = 0;
  squares_ = 0;
  std::ranges::fill(gram_, 0.0f);
  std::ranges::fill(products_, 0.0f);
}

void SurfaceCorrection::add(const Observation& seen) noexcept {
  combine(seen.states);
  measure(seen);
  if (measured_ == 0) return;
  all_measured_ += measured_;
  weigh_robustly();
  squares_ += set_rows(seen.states);
  Shift& shift = shifts_[rigs_];
  shift.samples = &of_shifts_[3 * rigs_++ * estimate_->samples().size()];
  add_products(shift);
}

void SurfaceCorrection::join(const SurfaceCorrection& other) noexcept {
  if (other.rigs_ == 0) return;
  all_measured_ += other.all_measured_;
  squares_ += other.squares_;
  std::ranges::transform(gram_, other.gram_, gram_.begin(), std::plus<>{});
  std::ranges::transform(products_, other.products_, products_.begin(), std::plus<>{});
  shifts_[rigs_++] = other.shifts_[0];
}

std::span<const float> SurfaceCorrection::solve() noexcept {
  if (rigs_ == 0) return {};
  // The fewer nodes are measured, the less they tell of the others
  const float nodes = static_cast<float>(shapes_.nodes()), measured = static_cast<float>(all_measured_);
  const float price = price_ * nodes * nodes / measured * (squares_ / static_cast<float>(rigs_));
  if (!(price >= std::numeric_limits<float>::min())) return {};  // all samples have the same shape
  for (Shift& shift : std::span(shifts_).first(rigs_)) eliminate(shift, price);
  return weights_for(price);
}

SurfaceEquations SurfaceCorrection::equations() const noexcept {
  const std::size_t samples = estimate_->samples().size();
  return {shape_,  normals_,        distances_, std::span(rows_).first(samples * shapes_.stride()),
          samples, shapes_.nodes(), measured_,  squares_ / static_cast<float>(rigs_)};
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
  for (std::size_t k = 0; k < estimate_->samples().size(); ++k) {
    const float* const of_sample = shape_of(k, states).data();
    const float weight = estimate_->samples()[k].weight;
    for (std::size_t i = 0; i < shape_.size(); i += 4)
      put(four_at(&shape_[i]) + weight * four_at(&of_sample[i]), &shape_[i]);
  }
}

void SurfaceCorrection::measure(const Observation& seen) noexcept {
  std::ranges::fill(normals_, 0.0f);
  std::ranges::fill(distances_, 0.0f);
  measured_ = 0;
  for (std::size_t i = 0; i < shapes_.nodes(); ++i) measure(i, seen);
}

/// Sets the normal and the distance of a node, unless the frame shows no plane near its line of sight.
void SurfaceCorrection::measure(std::size_t node, const Observation& seen) noexcept {
  constexpr float reach = 4, farthest = 2, width = 0.7f;  // in cells: along the line of sight, from a plane, of a plane
  constexpr float fewest = 4;                             // points, weighted
  constexpr float off_center = 0.25f;                     // in widths: the points of an edge lie on one side
  const std::size_t stride = shapes_.stride();
  const auto& T = seen.camera.T_reference_sensor;
  Vector sight, place;  // sight: from the eye
  for (std::size_t k = 0; k < 3; ++k) sight[k] = shape_[k * stride + node] - T[4 * k + 3];
  const float depth = dot(sight, {T[2], T[6], T[10]}), cell = depth / seen.camera.focal;
  const float farther = depth_at(sight, depth, seen) - depth;
  if (!(std::abs(farther) < reach * cell)) return;
  for (std::size_t k = 0; k < 3; ++k) place[k] = shape_[k * stride + node] + sight[k] * farther / depth;
  Moments moments(place, width * cell);
  std::array<const Leaf*, 8> leaves;
  const std::size_t count = seen.index.find_around(place, leaves);
  for (std::size_t i = 0; i < count; ++i) moments.add(*leaves[i]);
  const auto sums = moments.sums();
  if (!(sums[0] >= fewest)) return;
  const Plane plane = Plane::through(sums, sight);
  const float along = dot(plane.center, sight),
              across = dot(plane.center, plane.center) - along * along / dot(sight, sight);
  const float distance = dot(plane.normal, plane.center) + dot(plane.normal, sight) * farther / depth;
  if (!(across < square(off_center * width * cell) && std::abs(distance) < farthest * cell)) return;
  for (std::size_t k = 0; k < 3; ++k) normals_[k * stride + node] = plane.normal[k];
  distances_[node] = distance;
  ++measured_;
}

/// Multiplies the equations by the roots of Cauchy weights.
void SurfaceCorrection::weigh_robustly() noexcept {
  constexpr float means = 1.5f;
  float sum = 0;
  for (const float distance : distances_) sum += std::abs(distance);
  const float scale = std::max(means * sum / static_cast<float>(measured_), std::numeric_limits<float>::min());
  const std::size_t stride = shapes_.stride();
  for (std::size_t i = 0; i < stride; ++i) {
    const float root = 1 / std::sqrt(1 + square(distances_[i] / scale));
    distances_[i] *= root;
    for (std::size_t axis = 0; axis < 3; ++axis) normals_[axis * stride + i] *= root;
  }
}

/// Returns the samples' mean squared distance from the estimate.
float SurfaceCorrection::set_rows(std::span<const StateBetween> states) noexcept {
  const std::size_t stride = shapes_.stride(), samples = estimate_->samples().size();
  Four squares{};
  for (std::size_t s = 0; s < samples; ++s) {
    const float* const of_sample = shape_of(s, states).data();
    for (std::size_t i = 0; i < stride; i += 4) {
      Four change{};
      for (std::size_t k = i; k < 3 * stride; k += stride) {
        const Four offset = four_at(&of_sample[k]) - four_at(&shape_[k]);
        change += four_at(&normals_[k]) * offset;
        squares += offset * offset;
      }
      put(change, &row(s)[i]);
    }
  }
  return (squares[0] + squares[1] + squares[2] + squares[3]) / static_cast<float>(samples * shapes_.nodes());
}

/// Adds the rig's normal equations. The columns of its shift are the normals.
void SurfaceCorrection::add_products(Shift& shift) noexcept {
  const std::size_t k = estimate_->samples().size(), stride = shapes_.stride();
  for (std::size_t i = 0; i < k; ++i) {
    code_.project(rows_.data(), i + 1, stride, row(i).data(), sums_.data());
    for (std::size_t j = 0; j <= i; ++j) gram_[j * k + i] += sums_[j];
  }
  code_.project(rows_.data(), k, stride, distances_.data(), sums_.data());
  for (std::size_t i = 0; i < k; ++i) products_[i] += sums_[i];
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* const normals = &normals_[axis * stride];
    code_.project(normals_.data(), 3, stride, normals, shift.matrix[axis].data());
    code_.project(normals, 1, stride, distances_.data(), &shift.constant[axis]);
    code_.project(rows_.data(), k, stride, normals, &shift.samples[axis * k]);
  }
}

/// A shift of the whole component is an error of the rig's pose, not a deformation: its three unknowns are eliminated
/// from the normal equations. A shift by shift_ costs as much as a weight of 1.
void SurfaceCorrection::eliminate(Shift& shift, float price) noexcept {
  const std::size_t k = estimate_->samples().size();
  auto& [matrix, constant, samples] = shift;
  for (std::size_t axis = 0; axis < 3; ++axis) matrix[axis][axis] += price / square(shift_);
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const float* const row = &samples[axis * k];
    const float pivot = matrix[axis][axis];
    for (std::size_t i = 0; i < k; ++i) {
      const float factor = row[i] / pivot;
      for (std::size_t j = i; j < k; ++j) gram_[i * k + j] -= factor * row[j];
      products_[i] -= factor * constant[axis];
    }
    for (std::size_t other = axis + 1; other < 3; ++other) {
      const float factor = matrix[other][axis] / pivot;
      for (std::size_t m = axis; m < 3; ++m) matrix[other][m] -= factor * matrix[axis][m];
      for (std::size_t i = 0; i < k; ++i) samples[other * k + i] -= factor * row[i];
      constant[other] -= factor * constant[axis];
    }
  }
}

std::span<const float> SurfaceCorrection::weights_for(float price) noexcept {
  const auto before = estimate_->samples();
  const std::size_t k = before.size();
  const auto changes = std::span(changes_).first(k);
  std::ranges::copy(std::span(products_).first(k), changes.begin());
  const auto weights = std::span(weights_).first(k);  // first the prices
  std::ranges::fill(weights, price);
  ridge_.factorize(gram_, k, weights);
  ridge_.substitute(changes);
  const double all = std::accumulate(changes.begin(), changes.end(), 0.0);
  for (std::size_t i = 0; i < k; ++i)
    weights[i] = static_cast<float>((1 - all) * double{before[i].weight} + changes[i]);
  return weights;
}

}  // namespace lbea
