// Depth images and estimates of samples that have lost elements.
#include "precompute/depth_images/rendered_views.hpp"
#include "runtime/src/model/eroded_elements.hpp"
#include "tests/precompute/survey/eroding_model.hpp"

#include <lbea/inference.hpp>

#include <doctest/doctest.h>

#include <algorithm>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

std::size_t filled_cells(const SensorViews& views, std::uint32_t sample) {
  const std::vector<float> image = views.depth_image(sample);
  return static_cast<std::size_t>(std::ranges::count_if(image, [](float depth) { return !std::isnan(depth); }));
}

std::vector<Point> frame_of(const SimulationState& state) {
  const SimulationMesh mesh = plate_mesh();
  return VirtualSensor(rig_above(), mesh.nodes(), mesh.elements).sense({state.positions, state.alive}, {}, 1);
}

MatchResult matched(Matcher& matcher, const std::vector<Point>& points) {
  Frame frame{};
  frame.points = points;
  return matcher.match(frame);
}

}  // namespace

TEST_CASE("depth images have the hole in the samples that have it, also those that are rendered later") {
  const Model model = Model::view(eroding_model().span());
  const SensorViews baked = SensorViews::baked_into(model);
  std::vector<Quad> elements(model.elements());
  for (std::size_t i = 0; i < model.element_nodes().size(); ++i) elements[i / 4][i % 4] = model.element_nodes()[i];
  const auto& survey = model.view().depth_images->camera;
  std::array<float, 3> low{1e9f, 1e9f, 1e9f}, high{-1e9f, -1e9f, -1e9f};
  for (std::uint32_t s = 0; s < model.samples(); ++s)
    for (std::size_t i = 0; i < model.node_positions(s).size(); ++i) {
      low[i % 3] = std::min(low[i % 3], model.node_positions(s)[i]);
      high[i % 3] = std::max(high[i % 3], model.node_positions(s)[i]);
    }
  const auto renderer = make_depth_renderer(rig_above(), model.nodes(), elements, low, high);
  REQUIRE(renderer->camera().columns == survey.columns);
  const SensorViews rendered = render_depth_images(model, *renderer, 0);
  for (std::uint32_t s = 0; s < model.samples(); ++s) {
    const auto [simulation, step] = model.sample(s);
    const std::uint32_t twin = model.sample_index({simulation ^ 1, step});
    const std::size_t filled = filled_cells(baked, s), of_twin = filled_cells(baked, twin);
    if (has_hole({simulation, step}))
      CHECK(filled + 10 < of_twin);
    else if (!has_hole({simulation ^ 1, step}))
      CHECK(filled == of_twin);
    CHECK(filled_cells(rendered, s) == filled);
  }
}

TEST_CASE("the images of further rigs have the hole, too") {
  BakeOptions options = with_views();
  options.more_depth_renderers.push_back(options.depth_renderer);
  const TemporaryFolder folder;
  bake_model(eroding_plates(2, steps, from), bent_plates_description(), folder / "m.lbea", options);
  const Model model = Model::open(folder / "m.lbea");
  REQUIRE(model.view().more_depth_images.size() == 1);
  CHECK(std::ranges::equal(model.view().depth_images->depths, model.view().more_depth_images[0]->depths));
}

TEST_CASE("a frame with the hole is matched to the run that has it, one without to its twin") {
  const Model model = Model::view(eroding_model().span());
  Matcher matcher(model, fit_config());
  for (const std::uint32_t pair : {0u, 2u})
    for (const bool erodes : {false, true}) {
      SimulationState state;
      eroding_plate(0.5 + 0.1 * pair, steps, erodes ? from : steps).read(steps - 1, state);
      const MatchResult result = matched(matcher, frame_of(state));
      REQUIRE(result.status == Status::ok);
      REQUIRE(!result.fit.candidates.empty());
      CHECK(result.fit.candidates.front().sample == Sample{2 * pair + (erodes ? 1u : 0u), steps - 1});
    }
}

TEST_CASE("an estimate has lost an element when samples with at least half of the weight have") {
  const Model model = Model::view(eroding_model().span());
  const Sample whole{2, steps - 1}, eroding{3, steps - 1};
  const std::size_t element = patch_elements()[5];
  const float value = model.field_values(0, model.sample_index(whole))[element];
  for (const float weight : {0.25f, 0.5f, 0.75f}) {
    const std::vector<WeightedSample> estimate{{whole, 1 - weight}, {eroding, weight}};
    Inferred inferred;
    infer_field(model, 0, estimate, estimate, inferred);
    CHECK(std::isnan(inferred.mean[element]) == (weight >= 0.5f));
    if (weight < 0.5f) CHECK(inferred.mean[element] == value);
    CHECK_FALSE(std::isnan(inferred.mean[0]));
    CHECK_FALSE(std::isnan(inferred.spread[0]));
  }
}

TEST_CASE("the estimate of an unseen run has lost what similar runs have lost") {
  Ensemble ensemble;
  const auto erodes_from = [](double angle) { return angle > 0.85 ? from : steps; };  // those that bend far
  for (std::uint32_t run = 0; run < 8; ++run) {
    const double angle = 0.5 + 0.1 * run;
    ensemble.runs.push_back({"plate_" + std::to_string(run), {}, [=] {
                               return std::make_unique<SyntheticSimulation>(
                                   eroding_plate(angle, steps, erodes_from(angle)));
                             }});
  }
  const TemporaryFolder folder;
  bake_model(ensemble, bent_plates_description(), folder / "m.lbea", with_views());
  const Model model = Model::open(folder / "m.lbea");
  Matcher matcher(model, fit_config());
  for (const double angle : {0.65, 0.75, 1.05, 1.15}) {
    SimulationState state;
    eroding_plate(angle, steps, erodes_from(angle)).read(steps - 1, state);
    const MatchResult result = matched(matcher, frame_of(state));
    Inferred inferred;
    infer_field(model, 0, result.fit, inferred);
    CAPTURE(angle);
    CHECK(std::isnan(inferred.mean[patch_elements()[5]]) == (erodes_from(angle) == from));
    CHECK_FALSE(std::isnan(inferred.mean[0]));
  }
}
