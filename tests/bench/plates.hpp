// A model of bending plates and a noisy cloud of one of its samples, seen from a rotated sensor.
#pragma once

#include "tests/support/synthetic_model.hpp"
#include "tools/bench/answer.hpp"
#include "tools/bench/pipeline.hpp"

#include <memory>
#include <random>
#include <vector>

namespace lbea::test {

using namespace lbea::bake;
using namespace lbea::tool;

/// sensor -> reference: a rotation about z and a shift.
inline constexpr RigidTransform plates_pose{0.8f, -0.6f, 0, 30, 0.6f, 0.8f, 0, -20, 0, 0, 1, 5};

struct Plates {
  AlignedBytes bytes = bent_plates_model();
  Model model = Model::view(bytes.span());
  MatcherConfig config{.max_points = 4'000, .T_reference_sensor = plates_pose};
  std::vector<Point> points = measured(7, 4'000);
  Frame frame{.points = points};

  /// Nodes of `sample`, repeated, with noise, in sensor coordinates.
  [[nodiscard]] std::vector<Point> measured(std::uint32_t sample, std::size_t count) const {
    std::mt19937 random(5);
    std::normal_distribution<float> noise(0, 0.5f);
    const std::span<const float> nodes = model.node_positions(sample);
    std::vector<Point> result;
    for (std::size_t i = 0; i < count; ++i) {
      const std::size_t from = 3 * (i % model.nodes());
      const float x = nodes[from] + noise(random) - 30, y = nodes[from + 1] + noise(random) + 20,
                  z = nodes[from + 2] + noise(random) - 5;
      result.push_back({0.8f * x + 0.6f * y, -0.6f * x + 0.8f * y, z});
    }
    return result;
  }

  [[nodiscard]] bench::MatchTask task() const {
    return {model.view(), config.method, config.T_reference_sensor, config.max_matches};
  }

  [[nodiscard]] std::vector<std::unique_ptr<bench::Pipeline>> pipelines() const {
    std::vector<std::unique_ptr<bench::Pipeline>> all;
    all.push_back(bench::matcher_pipeline(model, config));
    all.push_back(bench::nanoflann_pipeline(model, config));
    for (const Kernels* const* code = available_kernels(); *code != nullptr; ++code)
      all.push_back(bench::kernels_pipeline(model, config, **code, (*code)->name));
    return all;
  }
};

}  // namespace lbea::test
