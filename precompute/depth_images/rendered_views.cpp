#include "precompute/depth_images/rendered_views.hpp"

#include "precompute/depth_images/learned_fit.hpp"
#include "runtime/src/model/eroded_elements.hpp"

#include <algorithm>
#include <atomic>

namespace lbea::bake {
namespace {

/// Owns the memory of SensorViews' spans.
struct RenderedImages {
  std::vector<std::uint16_t> depths;
  LearnedFit learned;
};

SampleSource source_of(const Model& model, const DepthCamera& camera) {
  SampleSource source{.camera = camera, .length_unit = std::string(model.length_unit()), .nodes = model.nodes()};
  for (std::uint32_t s = 0; s < model.samples(); ++s) source.samples.push_back(model.sample(s));
  if (const auto& baked = model.view().depth_images) source.prices = baked->prices;
  source.read_positions = [&model](std::size_t sample, std::span<float> positions) {
    std::ranges::copy(model.node_positions(static_cast<std::uint32_t>(sample)), positions.begin());
  };
  return source;
}

/// source: without images.
SensorViews rendered_views(const Model& model, SampleSource source, const SampleRenderer& render,
                           const Workers& workers, const std::function<void(std::size_t done)>& progress) {
  const std::size_t stride = padded_cells(source.camera);
  auto rendered = std::make_shared<RenderedImages>();
  rendered->depths.assign(model.samples() * stride, empty_cell);
  std::atomic<std::size_t> done{0};
  work_in_parallel(model.samples(), workers, [&](const auto& next) {
    for (std::size_t s = next(); s < model.samples(); s = next()) {
      render(static_cast<std::uint32_t>(s), std::span(rendered->depths).subspan(s * stride, stride));
      const std::size_t now = ++done;
      if (progress) progress(now);
    }
  });
  source.read_images = [&](std::size_t first, std::span<std::uint16_t> images) {
    std::copy_n(rendered->depths.begin() + static_cast<std::ptrdiff_t>(first * stride), images.size(), images.begin());
  };
  rendered->learned = learn_fit(source, workers);
  const LearnedFit& learned = rendered->learned;
  return SensorViews(std::make_shared<const DepthImages>(DepthImages{source.camera,
                                                                     rendered->depths,
                                                                     learned.expected,
                                                                     learned.costs.metric,
                                                                     learned.costs.prices,
                                                                     learned.limits.frame,
                                                                     learned.limits.test,
                                                                     learned.error_bound,
                                                                     learned.hidden_error_bound,
                                                                     static_cast<float>(learned.pose.variance),
                                                                     learned.pose.by_image,
                                                                     learned.pose.by_points,
                                                                     learned.time_variation,
                                                                     learned.shapes.view(),
                                                                     {},
                                                                     rendered}));
}

}  // namespace

SensorViews render_depth_images(const Model& model, const DepthRenderer& renderer, const Workers& workers,
                                const std::function<void(std::size_t done)>& progress) {
  const auto render = [&](std::uint32_t sample, std::span<std::uint16_t> image) {
    renderer.render(model.node_positions(sample), present_elements(model, sample), image);
  };
  SampleSource source = source_of(model, renderer.camera());
  source.points_of = [&](std::size_t sample) {
    const auto number = static_cast<std::uint32_t>(sample);
    return renderer.points(model.node_positions(number), present_elements(model, number));
  };
  source.most_points = renderer.most_points();
  source.grid = envelope_grid(model.view().envelope);
  const ModelView& view = model.view();
  source.surface = surface_places(view.references.front().vertex_nodes, view.element_nodes, view.info.nodes,
                                  !view.landmark_positions.empty());
  return rendered_views(model, std::move(source), render, workers, progress);
}

SensorViews render_depth_images(const Model& model, const DepthCamera& camera, const SampleRenderer& render,
                                const Workers& workers, const std::function<void(std::size_t done)>& progress) {
  return rendered_views(model, source_of(model, camera), render, workers, progress);
}

}  // namespace lbea::bake
