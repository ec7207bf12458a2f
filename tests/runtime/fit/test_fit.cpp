// Method::fit end to end: plates under a rig, baked with their depth images, recognised by what the rig sees.
#include "runtime/src/fit/surface_fit.hpp"
#include "tests/runtime/fit/seen_plates.hpp"

#include <lbea/inference.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("landmarks are the same whether those of all samples were copied or not; moved shapes differ by the motion") {
  const AlignedBytes bytes = seen_plates_model(3, 4);
  const Model model = Model::view(bytes.span());
  for (const LandmarkPlaces places : {LandmarkPlaces::component, LandmarkPlaces::surface}) {
    const ShapeLandmarks copied(model.view(), places), read(model.view(), places, 0);
    std::vector<float> unused(copied.size()), buffer(copied.size()), moved(copied.size());
    for (std::uint32_t s = 0; s < model.samples(); ++s) {
      const auto shape = copied.of(s, true, unused);
      CHECK(std::ranges::equal(shape, read.of(s, true, buffer)));
      std::ranges::copy(shape, moved.begin());
      for (std::size_t i = 0; i < moved.size() / 3; ++i) moved[i] += 3, moved[2 * moved.size() / 3 + i] -= 4;
      CHECK(copied.mean_distance(shape, shape) == 0);
      CHECK(copied.mean_distance(shape, moved) >= 5 * (1 - 1e-4f));  // padding moved too
    }
    CHECK(std::ranges::count(unused, 0.0f) == static_cast<std::ptrdiff_t>(unused.size()));
  }
}

TEST_CASE("every sample that the rig sees is found again, noise or not") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  for (const float sigma : {0.0f, 0.5f})
    for (std::uint32_t s = 0; s < model.samples(); ++s) {
      CAPTURE(s);
      const auto positions = model.node_positions(s);
      const auto points = seen({positions.begin(), positions.end()}, {.sigma = sigma}, s);
      const MatchResult result = matcher.match({.id = s, .points = points});
      REQUIRE(result.status == Status::ok);
      const auto found = model.node_positions(model.sample_index(result.matches[0].sample));
      CHECK(mean_distance(found, positions) < 1e-3);  // the first states of all runs are one shape
      CHECK(result.verdict == Verdict::matched);
      CHECK(std::ranges::is_sorted(result.fit.candidates, {}, &Match::distance));
      CHECK(result.fit.residual == result.fit.candidates[0].distance);
      float shares = 0;
      for (const auto& [sample, weight] : result.fit.estimate) shares += weight;
      CHECK(shares == doctest::Approx(1).epsilon(1e-4));
    }
}

TEST_CASE("a shape between the samples is estimated nearer than any sample is") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  int between = 0;
  for (double angle = 0.3; angle < 0.97; angle += 0.02) {
    CAPTURE(angle);
    const auto truth = bent(angle);
    if (nearest_sample(model, truth) < 0.5) continue;  // as good as a sample
    ++between;
    const MatchResult result = matcher.match({.points = seen(truth)});
    REQUIRE(result.status == Status::ok);
    const double estimated = mean_distance(mesh_of(model, result.fit.estimate), truth);
    CHECK(estimated < 0.85 * nearest_sample(model, truth));
    const double spread = double{result.fit.spread};
    CHECK(double{result.fit.error_90} ==
          doctest::Approx(SensorViews::baked_into(model).data()->error_bound.per_spread_at(spread) * spread));
    CHECK(estimated < result.fit.error_90);  // denser than the runs that the bound was learned from
    CHECK(result.fit.estimate_residual <= result.fit.residual + 1e-3f);
    CHECK(result.verdict == Verdict::matched);
  }
  CHECK(between >= 3);
}

// A sample that is 5 mm beside the free end did not count as seen there.
TEST_CASE("coverage is the share that is seen, also of a shape between the samples") {
  constexpr double angle = 0.95, length = 190, curvature = angle / length;
  constexpr double of_places = 0.05;  // a column of them, and what lies within 3 mm of the border
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  std::vector<Point> points = seen(bent(angle));
  CHECK(matcher.match({1, 0, points}).coverage > 0.98f);
  const double middle =
      std::sin(curvature * length / 2) / curvature - length / 2;  // of the arc, x in the sensor's system
  std::erase_if(points, [middle](const Point& p) { return double{p.x} > middle; });
  CHECK(std::abs(double{matcher.match({2, 0, points}).coverage} - 0.5) < of_places);
}

TEST_CASE("a fit has the coefficients of its estimate") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  const ReferenceView& reference = model.view().references.front();
  Matcher matcher(model, fit_config());
  const MatchResult result = matcher.match({.points = seen(bent(0.75))});
  REQUIRE(result.fit.estimate.size() > 1);
  REQUIRE(result.coefficients.size() == std::size_t{3} * model.modes());
  const std::size_t stride = format::padded(model.modes());
  for (std::size_t axis = 0; axis < 3; ++axis)
    for (std::size_t j = 0; j < model.modes(); ++j) {
      double sum = 0, largest = 0;
      for (const auto& [sample, weight] : result.fit.estimate) {
        const double term =
            static_cast<double>(weight) *
            static_cast<double>(reference.coefficients[(3 * model.sample_index(sample) + axis) * stride + j]);
        sum += term;
        largest = std::max(largest, std::abs(term));
      }
      CHECK(std::abs(static_cast<double>(result.coefficients[3 * j + axis]) - sum) <= 1e-5 * largest);
    }
}

TEST_CASE("bounds of node positions follow their spread, and hold for shapes between the samples") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  const SpreadBound learned = SensorViews::baked_into(model).data()->bounds.at(0);
  REQUIRE(learned.per_spread > 0);
  Matcher matcher(model, fit_config());
  Inferred shape, alone;
  std::size_t nodes = 0, within = 0;
  for (double angle = 0.3; angle < 0.97; angle += 0.02) {
    const auto truth = bent(angle);
    const MatchResult result = matcher.match({.points = seen(truth)});
    REQUIRE(result.status == Status::ok);
    infer_positions(model, result.fit, shape);
    REQUIRE(shape.bound_90.size() == model.nodes());
    double squares = 0;
    for (const float spread : shape.spread) squares += double{spread} * double{spread} / model.nodes();
    const double scale = learned.per_spread * double{result.fit.error_90} / double{result.fit.spread};
    for (std::size_t i = 0; i < model.nodes(); ++i) {
      const double evened = std::hypot(double{shape.spread[i]}, learned.share * std::sqrt(squares));
      CHECK(double{shape.bound_90[i]} == doctest::Approx(scale * evened).epsilon(1e-4));
      const double error = mean_distance(std::span(shape.mean).subspan(3 * i, 3), std::span(truth).subspan(3 * i, 3));
      within += error <= double{shape.bound_90[i]} ? 1u : 0u;
      ++nodes;
    }
    infer_positions(model, result.fit.estimate, plausible_samples(model, result.fit.candidates), alone);
    CHECK(alone.mean == shape.mean);
    CHECK(alone.spread == shape.spread);
    CHECK(alone.bound_90.empty());
  }
  CHECK(within >= nodes * 9 / 10);  // denser than the runs that the bounds were learned from
  SurfaceFit unknown = matcher.match({.points = seen(bent(0.5))}).fit;
  unknown.error_90 = std::numeric_limits<float>::quiet_NaN();
  infer_positions(model, unknown, shape);
  CHECK(shape.bound_90.empty());
}

// The share of the difference between prediction and candidates that the estimate follows is learned, and limited.
TEST_CASE("a prediction moves the estimate, but an absurd one no further than any left-out run's did") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  DepthImages images = *SensorViews::baked_into(model).data();
  images.regression.blend = 0.5f;
  images.regression.most_difference = 2;
  const SensorViews views(std::make_shared<const DepthImages>(images));
  const ShapeRegression& regression = views.data()->regression;
  SurfaceFitter fitter(model.view(), views, 1);
  std::vector<RankedSample> all;
  for (std::uint32_t s = 0; s < model.samples(); ++s) all.push_back({s, 0});
  const auto estimated = [&](std::span<const float> predicted) {
    const auto image = views.data()->of_sample(8 * 3 + 5);
    std::vector<float> observed(image.begin(), image.end());
    std::ranges::replace(observed, 0.0f, nothing_seen);
    return mesh_of(model, fitter.fit({.observed = observed, .predicted = predicted}, all).estimate);
  };
  const std::vector<float> alone = estimated({});
  std::vector<float> prediction(ShapeRegression::shape_scores, 0.0f);
  CHECK(mean_distance(estimated(regression.shape(8 * 3 + 5)), alone) < 0.1);
  prediction[0] = std::numeric_limits<float>::quiet_NaN();
  CHECK(mean_distance(estimated(prediction), alone) < 0.1);
  prediction[0] = 1e9f;
  const double moved = mean_distance(estimated(prediction), alone);
  CHECK(moved > 0.2 * double{regression.blend} * double{regression.most_difference});
  CHECK(moved < 1.1 * double{regression.blend} * double{regression.most_difference} + 0.1);
}

// A forged model may hold such shapes. Their squared differences round to zero.
TEST_CASE("the shares of samples whose predicted shapes hardly differ are finite") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  DepthImages images = *SensorViews::baked_into(model).data();
  std::vector<RankedSample> all;
  for (std::uint32_t s = 0; s < model.samples(); ++s) all.push_back({s, 0});
  for (const float scale : {0.0f, 1e-24f, 1e-23f, 1e-22f, 1e-21f, 1e-20f}) {
    CAPTURE(scale);
    std::vector<float> shapes(images.regression.shapes.begin(), images.regression.shapes.end());
    for (float& score : shapes) score *= scale;
    DepthImages forged = images;
    forged.regression.shapes = shapes;
    forged.regression.blend = 0.5f;
    SurfaceFitter fitter(model.view(), SensorViews(std::make_shared<const DepthImages>(forged)), 1);
    std::vector<float> observed(padded_cells(forged.camera), 100.0f);
    const std::vector<float> prediction(ShapeRegression::shape_scores, 0.0f);
    float sum = 0;
    for (const WeightedSample& share : fitter.fit({.observed = observed, .predicted = prediction}, all).estimate)
      sum += share.weight;
    CHECK(sum == doctest::Approx(1).epsilon(1e-3));
  }
}

TEST_CASE("points that belong to nothing, and half of them gone, change no match") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  const std::uint32_t s = 8 * 3 + 5;
  const auto positions = model.node_positions(s);
  const MatchResult result = matcher.match(
      {.points = seen({positions.begin(), positions.end()}, {.outliers = 0.02f, .dropout = 0.6f, .background = 0.3f})});
  CHECK(result.points.culled > 0);
  CHECK(result.matches[0].sample == model.sample(s));
}

// Regression: only the cells next to a filled one were evidence, so that the long plate fitted better than the short
// one.
TEST_CASE("a frame that a sample explains completely counts against all that is longer") {
  const auto squeezed = [](float length, float height) {
    auto positions = plate_mesh().positions;
    for (std::size_t i = 0; i < positions.size(); i += 3) positions[i] *= length, positions[i + 2] += height;
    return positions;
  };
  Ensemble ensemble;
  for (const auto& last : {squeezed(0.5f, -7), squeezed(1, 0)})
    ensemble.runs.push_back(
        {"run_" + std::to_string(ensemble.runs.size()), {}, [last] {
           const SyntheticSimulation flat = bending_plate(0, 2);
           std::vector states{bent_state(flat.mesh(), 0, 0, 190), bent_state(flat.mesh(), 1e-3, 0, 190)};
           states[1].positions = last;
           return std::make_unique<SyntheticSimulation>(flat.mesh(), states, flat.fields());
         }});
  const TemporaryFolder folder;
  bake_model(ensemble, bent_plates_description(), folder / "m.lbea", with_views());
  const Model model = Model::open(folder / "m.lbea");
  // A height at which the long plate fits better when of its cells beside the frame's 32 columns only two columns
  // count.
  const float border = std::pow(SensorViews::baked_into(model).data()->metric.one_sided, 2.0f) * 2 / 34;
  float height = -7;
  while ((height + 7) * (height + 7) < 1.3f * (height * height + border)) height += 0.1f;
  MatcherConfig config = fit_config();
  config.min_coverage = 0;
  Matcher matcher(model, config);
  const MatchResult result = matcher.match({.points = seen(squeezed(0.5f, height))});
  REQUIRE(result.status == Status::ok);
  CHECK(result.matches[0].sample == Sample{0, 1});
}

TEST_CASE("without depth images there is nothing to fit, and the error says what to do") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  CHECK(SensorViews::baked_into(model).empty());
  try {
    Matcher(model, fit_config());
    FAIL("a matcher without images was made");
  } catch (const Error& error) {
    CHECK(error.status == Status::bad_config);
    CHECK(std::string(error.what()).find("baked without a sensor") != std::string::npos);
  }
}
