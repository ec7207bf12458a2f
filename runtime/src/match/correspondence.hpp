// Method step 3: for every vertex of the reference mesh, the nearest point of the cloud. And the coverage: the share of
// a sample's surface with a point nearby.
#pragma once

#include "runtime/src/depth/depth_images.hpp"
#include "runtime/src/match/cloud_index.hpp"
#include "runtime/src/model/model_view.hpp"

namespace lbea {
/// n positions as x, y and z planes, padded with zeros to whole 64-byte lines.
struct Positions {
  explicit Positions(std::size_t n) : count(n), planes{plane(n), plane(n), plane(n)} {}

  [[nodiscard]] std::array<float, 3> operator[](std::size_t i) const noexcept {
    return {planes[0][i], planes[1][i], planes[2][i]};
  }
  void set(std::size_t i, const std::array<float, 3>& position) noexcept {
    for (std::size_t axis = 0; axis < 3; ++axis) planes[axis][i] = position[axis];
  }

  std::size_t count;
  std::array<std::vector<float>, 3> planes;

 private:
  static std::vector<float> plane(std::size_t n) { return std::vector<float>(format::padded(n)); }
};

/// A limit for the time of a crowded cloud, of which many points may be equally distant from each of many vertices: in
/// tests of leaves beyond those of ordinary searches. Unlimited when the cloud is not crowded.
[[nodiscard]] std::uint32_t most_hard_tests(const CloudIndex& index, std::size_t vertices) noexcept;

/// corresponding[v] = position of the indexed point nearest to vertices[v]; exact, ties to the point that comes first
/// in the frame. On entry `corresponding` holds a guess, e.g. the result for the previous frame: a good one makes the
/// search faster, none changes its result. Fast when consecutive vertices are near each other. `points`, when not
/// empty, receives the points' places in the frame. The index must hold at least one point.
/// Once hard searches have made `most_tests`, further ones are cut: they give a point near the vertex, which may not be
/// the nearest one. Returns the number of vertices to which that may have happened. In a crowded cloud the guess is not
/// used, so that it never changes the result.
std::uint32_t correspond(const CloudIndex& index, std::span<const std::array<float, 3>> vertices,
                         Positions& corresponding, std::span<std::uint32_t> points = {},
                         std::uint32_t most_tests = NearestPoints::unlimited) noexcept;

/// is_shown[i] = whether an indexed point is within `distance` of position i.
void find_shown(const CloudIndex& index, std::span<const std::array<float, 3>> positions, float distance,
                std::span<std::uint8_t> is_shown) noexcept;

/// The mass of the shown positions, over that of all that can be seen. is_unseen: which cannot; empty: none.
[[nodiscard]] float share_shown(std::span<const std::uint8_t> is_shown, std::span<const double> mass,
                                std::span<const std::uint8_t> is_unseen = {}) noexcept;

/// The observed surface, of which a frame shows a share, the coverage: all vertices of a sample, or its landmarks where
/// the model has them; or the places of an estimate.
class ObservedSurface {
 public:
  /// places: of estimates; 0: for samples. Allocates all memory.
  explicit ObservedSurface(const ModelView& model, std::size_t places = 0);

  /// Copies the sample's positions. reference: one of the model's. Does not allocate.
  void take(std::uint32_t sample, const ReferenceView& reference) noexcept;
  /// The same of an estimate. planes: of x, y and z, `stride` values each. Does not allocate.
  void take(std::span<const float> planes, std::size_t stride) noexcept;
  /// Leaves out what a camera cannot see: where the depth image of a similar shape is empty, or shows something in
  /// front of it.
  void leave_out_unseen(const DepthCamera& camera, std::span<const std::uint16_t> image) noexcept;
  /// Finds what the frame shows, by points within `trusted_distance`. Does not allocate.
  void compare(const CloudIndex& index, float trusted_distance) noexcept {
    find_shown(index, positions_, trusted_distance, is_shown_);
  }
  /// Adds what the frame of another rig shows of the same estimate.
  void add(const ObservedSurface& other) noexcept;
  /// The share that is shown.
  [[nodiscard]] float coverage(const ReferenceView& reference) const noexcept;

 private:
  const ModelView& model_;
  std::vector<std::array<float, 3>> positions_;
  std::vector<std::uint8_t> is_shown_, is_unseen_;
  std::vector<std::vector<double>> part_mass_;  // per reference; none if the positions are those of all vertices
};
}  // namespace lbea
