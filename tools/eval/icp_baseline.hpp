// Method step 6, the baseline: point-to-point ICP of the frame to every sample. The match is the sample with the
// smallest final mean squared error.
#pragma once

#include "tools/shared/views/box_of_samples.hpp"

#include <lbea/lbea.hpp>

namespace lbea::tool {

struct IcpSettings {
  std::uint32_t iterations = 30;         // maximum
  double converged = 1e-4;               // relative decrease of the mean squared error that ends an alignment
  std::uint32_t points = 2'000;          // of the frame, evenly chosen
  std::uint32_t screening_points = 200;  // for a first alignment with all samples
  std::uint32_t finalists = 40;          // best samples of the screening, aligned with `points` points
  std::uint32_t subdivision = 3;         // points along each side of an element of a sample
};

struct IcpMatch {
  std::uint32_t sample = 0;
  double mean_squared_error = 0;
};

class IcpBaseline {
 public:
  /// Builds a search tree per sample from points on the elements of the observed region.
  explicit IcpBaseline(const Model& model, const IcpSettings& settings = {});
  ~IcpBaseline();

  /// points: at least three, in reference coordinates by the known pose, which is the start of every alignment. Safe to
  /// call from several threads.
  [[nodiscard]] IcpMatch match(std::span<const std::array<double, 3>> points) const;
  /// Final mean squared error of one sample.
  [[nodiscard]] double align(std::uint32_t sample, std::span<const std::array<double, 3>> points) const;

 private:
  struct Target;
  IcpSettings settings_;
  std::vector<std::unique_ptr<const Target>> targets_;
};

/// Reference coordinates of at most `most` points inside the box (lower and upper corner), evenly chosen in their
/// order.
[[nodiscard]] std::vector<std::array<double, 3>> spread_points(std::span<const Point> points,
                                                               const RigidTransform& T_reference_sensor,
                                                               const SampleBox& box, std::size_t most);

}  // namespace lbea::tool
