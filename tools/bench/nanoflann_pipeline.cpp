#include "tools/bench/nanoflann_pipeline.hpp"

#include "runtime/src/match/matcher.hpp"

#include <nanoflann.hpp>

#include <algorithm>
#include <cmath>

namespace lbea::tool::bench {
namespace {

// A data set with the members that nanoflann requires.
struct DataSet {
  const std::vector<std::array<float, 3>>& positions;

  [[nodiscard]] std::size_t kdtree_get_point_count() const { return positions.size(); }
  [[nodiscard]] float kdtree_get_pt(std::size_t point, std::size_t axis) const { return positions[point][axis]; }
  template <typename Box>
  bool kdtree_get_bbox(Box&) const {
    return false;
  }
};

using CloudKdTree =
    nanoflann::KDTreeSingleIndexAdaptor<nanoflann::L2_Simple_Adaptor<float, DataSet>, DataSet, 3, std::uint32_t>;

std::array<float, 3> transformed(const RigidTransform& T, const Point& p) {
  return {T[0] * p.x + T[1] * p.y + T[2] * p.z + T[3],  //
          T[4] * p.x + T[5] * p.y + T[6] * p.z + T[7],  //
          T[8] * p.x + T[9] * p.y + T[10] * p.z + T[11]};
}

}  // namespace

NanoflannPipeline::NanoflannPipeline(const Model& model, const MatcherConfig& config)
    : model_(model),
      view_(model_.view()),
      config_(config),
      grid_(envelope_grid(view_.envelope)),
      corresponding_(view_.info.vertices, 3),
      nearest_(view_.info.vertices),
      distances_(view_.info.samples) {}

PipelineTimes NanoflannPipeline::match(const Frame& frame) {
  PipelineTimes times;
  Stopwatch watch;
  reference_ = reference_at(view_, seconds_between(config_.trigger_ns, frame.stamp_ns));
  const ReferenceView& reference = view_.references[reference_];
  place(frame.points);
  ranked_.clear();
  if (points_.positions.empty()) return times;
  const DataSet data{points_.positions};
  const CloudKdTree tree(3, data);
  times.stages.index = watch.lap_ns();
  correspond(tree, reference);
  times.stages.correspondence = watch.lap_ns();
  project(reference);
  times.stages.projection = watch.lap_ns();
  config_.method == Method::vtp ? measure_vtp(reference) : measure_lbea(reference);
  rank();
  times.stages.matching = watch.lap_ns();
  return times;
}

Answer NanoflannPipeline::answer(const Frame& frame) {
  match(frame);
  Answer answer;
  answer.reference = reference_;
  answer.ranked = ranked_;
  for (const std::uint32_t point : nearest_) answer.points.push_back(points_.places.at(point));
  for (Eigen::Index j = 0; j < coefficients_.rows(); ++j)
    for (Eigen::Index axis = 0; axis < 3; ++axis) answer.coefficients.push_back(coefficients_(j, axis));
  return answer;
}

void NanoflannPipeline::place(std::span<const Point> points) {
  points_.positions.clear();
  points_.places.clear();
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::array<float, 3> position = transformed(config_.T_reference_sensor, points[i]);
    if (!inside(position)) continue;
    points_.positions.push_back(position);
    points_.places.push_back(static_cast<std::uint32_t>(i));
  }
}

bool NanoflannPipeline::inside(const std::array<float, 3>& position) const {
  std::size_t cell = 0;
  for (std::size_t axis = 3; axis-- > 0;) {
    const float along = (position[axis] - grid_.corner[axis]) * grid_.cells_per_length;
    if (!(along >= 0) || !(along < static_cast<float>(grid_.cells[axis]))) return false;
    cell = cell * grid_.cells[axis] + static_cast<std::size_t>(along);
  }
  return grid_.rank[cell] != CellGrid::outside;
}

template <typename Tree>
void NanoflannPipeline::correspond(const Tree& tree, const ReferenceView& reference) {
  for (std::size_t v = 0; v < nearest_.size(); ++v) {
    float squared = 0;
    tree.knnSearch(reference.vertex_positions[v].data(), 1, &nearest_[v], &squared);
    for (std::size_t axis = 0; axis < 3; ++axis)
      corresponding_(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
          points_.positions[nearest_[v]][axis];
  }
}

void NanoflannPipeline::project(const ReferenceView& reference) {
  const auto n = static_cast<Eigen::Index>(nearest_.size()),
             p = static_cast<Eigen::Index>(reference.eigenvalues.size());
  const Eigen::OuterStride<> stride(static_cast<Eigen::Index>(format::padded(nearest_.size())));
  coefficients_.noalias() =
      Eigen::Map<const RowMajor, 0, Eigen::OuterStride<>>(reference.projection.data(), p, n, stride) * corresponding_;
}

void NanoflannPipeline::measure_lbea(const ReferenceView& reference) {
  const std::size_t p = reference.eigenvalues.size(), stride = format::padded(p);
  for (std::size_t s = 0; s < distances_.size(); ++s) {
    const float* sample = reference.coefficients.data() + 3 * stride * s;
    float sum = 0;
    for (std::size_t j = 0; j < p; ++j) {
      const float* e = coefficients_.data() + 3 * j;
      const float x = e[0] - sample[j], y = e[1] - sample[stride + j], z = e[2] - sample[2 * stride + j];
      sum += std::sqrt(x * x + y * y + z * z);
    }
    distances_[s] = sum;
  }
}

void NanoflannPipeline::measure_vtp(const ReferenceView& reference) {
  const std::size_t n = nearest_.size();
  for (std::size_t s = 0; s < distances_.size(); ++s) {
    float sum = 0;
    for (std::size_t i = 0; i < n; ++i) {
      const float* node =
          view_.node_positions.data() + 3 * (s * view_.info.nodes + reference.correspondence[s * n + i]);
      const auto [ex, ey, ez] = points_.positions[nearest_[i]];
      const float x = ex - node[0], y = ey - node[1], z = ez - node[2];
      sum += std::sqrt(x * x + y * y + z * z);
    }
    distances_[s] = sum / static_cast<float>(n);
  }
}

void NanoflannPipeline::rank() {
  std::vector<RankedSample> samples(distances_.size());
  for (std::uint32_t s = 0; s < samples.size(); ++s) samples[s] = {s, distances_[s]};
  ranked_ = least(std::move(samples), config_.max_matches);
}

std::vector<RankedSample> least(std::vector<RankedSample> samples, std::size_t count) {
  const std::size_t kept = std::min(count, samples.size());
  const auto nearer = [](const RankedSample& a, const RankedSample& b) {
    return a.distance != b.distance ? a.distance < b.distance : a.sample < b.sample;
  };
  std::partial_sort(samples.begin(), samples.begin() + static_cast<std::ptrdiff_t>(kept), samples.end(), nearer);
  samples.resize(kept);
  return samples;
}

std::unique_ptr<Pipeline> nanoflann_pipeline(const Model& model, const MatcherConfig& config) {
  return std::make_unique<NanoflannPipeline>(model, config);
}

}  // namespace lbea::tool::bench
