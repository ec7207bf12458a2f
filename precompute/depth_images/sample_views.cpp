#include "precompute/depth_images/sample_views.hpp"

#include "precompute/depth_images/view_learning.hpp"
#include "precompute/parallel.hpp"
#include "runtime/src/model/model_view.hpp"

#include <algorithm>
#include <atomic>
#include <memory>
#include <vector>

namespace lbea::bake {
namespace {

/// What SensorViews' spans lie in.
struct RenderedViews {
  std::vector<std::uint16_t> depths;
  LearntViews learnt;
};

}  // namespace

SensorViews render_views(const Model& model, const ViewRenderer& renderer, unsigned threads,
                         const std::function<void(std::size_t done)>& progress) {
  const DepthCamera& camera = renderer.camera();
  const std::size_t stride = padded_cells(camera);
  auto views = std::make_shared<RenderedViews>();
  views->depths.assign(model.samples() * stride, empty_cell);
  std::atomic<std::size_t> done{0};
  work_in_parallel(model.samples(), threads, [&](const auto& next) {
    for (std::size_t s = next(); s < model.samples(); s = next()) {
      renderer.render(model.node_positions(static_cast<std::uint32_t>(s)),
                      std::span(views->depths).subspan(s * stride, stride));
      const std::size_t now = ++done;
      if (progress) progress(now);
    }
  });
  std::vector<Sample> samples;
  for (std::uint32_t s = 0; s < model.samples(); ++s) samples.push_back(model.sample(s));
  const auto read = [&](std::size_t first, std::span<std::uint16_t> images) {
    std::copy_n(views->depths.begin() + static_cast<std::ptrdiff_t>(first * stride), images.size(), images.begin());
  };
  views->learnt = learn_views(camera, samples, read, threads);
  return SensorViews(std::make_shared<const DepthImages>(DepthImages{
      camera, views->depths, views->learnt.expected, views->learnt.limits.frame, views->learnt.limits.test, views}));
}

}  // namespace lbea::bake
