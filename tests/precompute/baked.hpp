// A baked model and its matrices, for tests.
#pragma once

#include "runtime/src/model/model_view.hpp"
#include "tests/support/synthetic_model.hpp"

#include <Eigen/Dense>

#include <cmath>

namespace lbea::test {

using namespace lbea::bake;

/// Baked and opened; owns the folder.
struct Baked {
  Baked(const Ensemble& ensemble, const EnsembleDescription& description, const BakeOptions& options = {})
      : summary(bake_model(ensemble, description, folder / "m.lbea", options)), model(Model::open(folder / "m.lbea")) {}

  TemporaryFolder folder;
  BakeSummary summary;
  Model model;

  [[nodiscard]] const ReferenceView& reference(std::uint32_t r = 0) const { return model.view().references[r]; }
  [[nodiscard]] std::vector<std::byte> bytes() const {
    const AlignedBytes image(folder / "m.lbea");
    return {image.span().begin(), image.span().end()};
  }
};

/// Psi' M as stored, p x n.
inline Eigen::MatrixXd projection(const Baked& baked, std::uint32_t r) {
  const auto n = static_cast<Eigen::Index>(baked.model.vertices()), p = static_cast<Eigen::Index>(baked.model.modes());
  const auto stride = static_cast<Eigen::Index>(format::padded(static_cast<std::size_t>(n)));
  Eigen::MatrixXd result(p, n);
  for (Eigen::Index j = 0; j < p; ++j)
    for (Eigen::Index v = 0; v < n; ++v)
      result(j, v) = static_cast<double>(baked.reference(r).projection[static_cast<std::size_t>(j * stride + v)]);
  return result;
}

inline std::uint32_t nearest_node(std::span<const float> nodes, const std::array<float, 3>& vertex) {
  std::uint32_t best = 0;
  double least = INFINITY;
  for (std::uint32_t i = 0; i < nodes.size() / 3; ++i) {
    double squared = 0;
    for (std::size_t axis = 0; axis < 3; ++axis) {
      const double difference = static_cast<double>(nodes[3 * i + axis]) - static_cast<double>(vertex[axis]);
      squared += difference * difference;
    }
    if (squared < least) least = squared, best = i;
  }
  return best;
}

/// Positions of a sample on the reference mesh, n x 3, by the definition.
inline Eigen::MatrixXd corresponding(const Baked& baked, std::uint32_t r, std::uint32_t sample) {
  const auto nodes = baked.model.node_positions(sample);
  Eigen::MatrixXd f(baked.model.vertices(), 3);
  for (std::size_t v = 0; v < baked.model.vertices(); ++v) {
    const std::uint32_t node = baked.reference(r).correspondence[sample * baked.model.vertices() + v];
    for (std::size_t axis = 0; axis < 3; ++axis)
      f(static_cast<Eigen::Index>(v), static_cast<Eigen::Index>(axis)) =
          static_cast<double>(nodes[3 * std::size_t{node} + axis]);
  }
  return f;
}

inline Eigen::MatrixXd coefficients(const Baked& baked, std::uint32_t r, std::uint32_t sample) {
  const std::size_t plane = format::padded(baked.model.modes());
  Eigen::MatrixXd alpha(baked.model.modes(), 3);
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t j = 0; j < baked.model.modes(); ++j)
      alpha(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(axis)) =
          static_cast<double>(baked.reference(r).coefficients[(3 * sample + axis) * plane + j]);
  return alpha;
}

}  // namespace lbea::test
