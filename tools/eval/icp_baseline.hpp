// Method step 6, the baseline: point-to-point ICP of the frame onto every sample; least final mean squared error wins.
#pragma once

#include <lbea/lbea.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

namespace lbea::tool {

struct IcpSettings {
  std::uint32_t iterations = 30;         // at most
  double converged = 1e-4;               // relative fall of the mean squared error below which an alignment has ended
  std::uint32_t points = 2'000;          // of the frame, spread evenly
  std::uint32_t screening_points = 200;  // with which all samples are aligned, before
  std::uint32_t finalists = 40;          // the best of them are aligned with all `points`
  std::uint32_t subdivision = 3;         // a sample's element becomes that many points along each side
};

struct IcpMatch {
  std::uint32_t sample = 0;
  double mean_squared_error = 0;
};

class IcpBaseline {
 public:
  /// The observed region's elements of every sample become points in a tree each.
  explicit IcpBaseline(const Model& model, const IcpSettings& settings = {});
  ~IcpBaseline();

  /// points: reference coordinates, with the pose as it is known: where every alignment starts. Needs at least three
  /// points. Safe to call from several threads.
  [[nodiscard]] IcpMatch match(std::span<const std::array<double, 3>> points) const;
  /// Final mean squared error of one sample.
  [[nodiscard]] double align(std::uint32_t sample, std::span<const std::array<double, 3>> points) const;

 private:
  struct Target;
  IcpSettings settings_;
  std::vector<std::unique_ptr<const Target>> targets_;
};

/// Reference coordinates of at most `most` points inside the box (its least and greatest corner), evenly chosen in
/// their order.
[[nodiscard]] std::vector<std::array<double, 3>> spread_points(std::span<const Point> points,
                                                               const RigidTransform& T_reference_sensor,
                                                               const std::array<std::array<double, 3>, 2>& box,
                                                               std::size_t most);

}  // namespace lbea::tool
