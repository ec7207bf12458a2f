// The depth images of all samples, and what they say of the ensemble: how well do simulations explain one another?
#pragma once

#include "precompute/misfit.hpp"
#include "precompute/view_renderer.hpp"

#include <lbea/lbea.hpp>

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

namespace lbea {

class SampleViews {
 public:
  SampleViews(const ViewRenderer& renderer, std::size_t samples);

  /// Each sample once; from any thread.
  void render(std::size_t sample, std::span<const float> positions);
  /// After all samples. samples: ascending. Every sample (of many, every k-th) is held against all
  /// samples of the other simulations: what is left is what an unseen run leaves.
  void calibrate(std::span<const Sample> samples, unsigned threads);

  [[nodiscard]] const ViewCamera& camera() const noexcept { return camera_; }
  [[nodiscard]] std::span<const std::uint16_t> depths() const noexcept { return depths_; }
  [[nodiscard]] std::span<const float> expected() const noexcept { return expected_; }
  [[nodiscard]] float misfit_limit() const noexcept { return limits_.frame; }
  [[nodiscard]] float test_misfit_limit() const noexcept { return limits_.test; }

 private:
  const ViewRenderer& renderer_;
  ViewCamera camera_;
  std::vector<std::uint16_t> depths_;
  std::vector<float> expected_;
  MisfitLimits limits_;
};

/// The views of a model that was baked for another pose, or for none: rendered anew from its samples.
/// `progress`, when given, is called with the number of samples done, from any thread.
[[nodiscard]] SensorViews render_views(const Model& model, const ViewRenderer& renderer, unsigned threads,
                                       const std::function<void(std::size_t done)>& progress = {});

}  // namespace lbea
