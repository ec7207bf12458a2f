// The verdicts of Method::fit on single frames, and the bounds of their errors.
#include "tests/runtime/fit/seen_plates.hpp"

#include <lbea/inference.hpp>
#include <lbea/tracker.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

TEST_CASE("a plate that bends the other way, or folds, fits no simulation") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  MatcherConfig config = fit_config();
  config.min_coverage = 0;
  Matcher matcher(model, config);
  auto folded = bent(0.6);
  for (std::size_t i = 0; i < folded.size(); i += 3) folded[i + 2] += 12.0f * std::sin(folded[i] * 0.1f);
  auto sideways = plate_mesh().positions;
  for (std::size_t i = 0; i < sideways.size(); i += 3)
    sideways[i + 2] = 0.004f * (sideways[i] - 95) * (sideways[i] - 95);
  for (const auto& stranger : {folded, sideways}) {
    const MatchResult result = matcher.match({.points = seen(stranger)});
    CHECK(result.fit.misfit > SensorViews::baked_into(model).misfit_limit());
    CHECK(result.verdict == Verdict::no_simulation_fits);
  }
}

// The undeformed component, which hardly any run leaves a residual of, fitted no simulation when pixels were smaller
// than the rays of the bake's images. Sensors also lose edges, or widen them.
TEST_CASE("a sensor that loses a strip at the edges, or widens them, still sees the undeformed plate") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  const float limit = SensorViews::baked_into(model).misfit_limit();
  const auto cell = 600 / SensorViews::baked_into(model).data()->camera.focal;  // mm
  for (const double angle : {0.0, 0.1, 0.3})
    for (const float strip : {0.0f, 0.25f * cell, 0.5f * cell, 0.75f * cell}) {
      CAPTURE(strip);
      std::vector<Point> points = seen(bent(angle));
      const auto [left, right] = std::ranges::minmax(points, {}, &Point::x);
      const auto [low, high] = std::ranges::minmax(points, {}, &Point::y);
      std::vector<Point> lost, widened = points;
      for (const Point& p : points) {
        if (p.x > left.x + strip && p.x < right.x - strip && p.y > low.y + strip && p.y < high.y - strip)
          lost.push_back(p);
        for (const float x : {-strip, strip}) widened.push_back({p.x + x, p.y, p.z});
      }
      for (const auto& cloud : {points, lost, widened}) {
        const MatchResult result = matcher.match({.points = cloud});
        CHECK(result.fit.misfit < limit);
        CHECK(result.verdict == Verdict::matched);
      }
    }
}

// Frames with 390 points of a run in the ensemble were of no simulation: most cells were empty by chance.
TEST_CASE("a frame with less than one point per cell says nothing about whether a simulation fits") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  MatcherConfig config = fit_config();
  config.min_coverage = 0;
  Matcher matcher(model, config);
  const auto filled = static_cast<std::size_t>(std::ranges::count_if(
      SensorViews::baked_into(model).data()->of_sample(0), [](auto d) { return d != empty_cell; }));
  std::mt19937 random(1);
  for (const double angle : {0.0, 0.2, 0.5, 0.8}) {
    std::vector<Point> points = seen(bent(angle));
    std::ranges::shuffle(points, random);
    CHECK(matcher.match({.points = std::span(points).first(3 * filled)}).verdict == Verdict::matched);
    for (const std::size_t count : {filled / 4, filled / 2, 3 * filled / 4}) {
      const MatchResult result = matcher.match({.points = std::span(points).first(count)});
      CHECK(result.verdict == Verdict::unknown);
      CHECK(std::isnan(result.fit.error_90));
    }
  }
}

// An undeformed rail of which one half was hidden had a bound of 2 mm, and an error of 19.
TEST_CASE("the error of a frame is not bounded if more than half of the component is hidden") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  Inferred shape;
  for (const double angle : {0.2, 0.5, 0.8}) {
    std::vector<Point> points = seen(bent(angle));
    CHECK(std::isfinite(matcher.match({.points = points}).fit.error_90));
    std::erase_if(points, [](const Point& p) { return p.x > -30; });
    const SurfaceFit fit = matcher.match({.points = points}).fit;
    CHECK(std::isnan(fit.error_90));
    infer_positions(model, fit, shape);
    CHECK(shape.bound_90.empty());
  }
}

// Four frames of one stray point each gave the test the verdict that no simulation fits.
TEST_CASE("a few stray points are no evidence about the simulations") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  Tracker tracker(model);
  const std::vector<Point> points = seen(bent(0.6));
  for (std::size_t frame = 0; frame < 8; ++frame) {
    std::vector<Point> stray{points[100 * frame], points[100 * frame + 1], points[3 * frame]};
    for (Point& point : stray) point.z -= 15;
    const MatchResult result = matcher.match({.id = frame, .points = stray});
    REQUIRE(result.status == Status::low_coverage);
    CHECK(result.verdict == Verdict::unknown);
    CHECK(std::isnan(result.fit.misfit));
    CHECK(std::isnan(result.fit.error_90));
    CHECK(tracker.update(result).verdict == Verdict::unknown);
  }
}

// Every frame of another run was called `no simulation fits`, since the expected residual of one simulation is 0.
TEST_CASE("a model of an earlier version, without expected residuals, is matched without a verdict") {
  const AlignedBytes bytes(data() / "fuzz" / "model" / "views.lbea");  // of version 1.0
  const Model model = Model::view(bytes.span());
  MatcherConfig config;
  config.method = Method::fit;
  config.T_reference_sensor = SensorViews::baked_into(model).data()->camera.T_reference_sensor;
  config.min_coverage = 0;
  Matcher matcher(model, config);
  Tracker tracker(model);
  const RigidTransform& T = config.T_reference_sensor;
  const auto positions = model.node_positions(0);
  std::vector<Point> points;
  for (std::size_t n = 0; n < positions.size(); n += 3) {
    const auto along = [&](std::size_t axis) {  // R^T (p - t)
      float sum = 0;
      for (std::size_t i = 0; i < 3; ++i) sum += T[4 * i + axis] * (positions[n + i] - T[4 * i + 3]);
      return sum;
    };
    points.push_back({along(0), along(1), along(2)});
  }
  for (int frame = 0; frame < 5; ++frame) {
    const MatchResult result = matcher.match({.points = points});
    CHECK(result.status == Status::ok);
    CHECK(result.verdict == Verdict::unknown);
    CHECK(tracker.update(result).verdict == Verdict::unknown);
  }
}

TEST_CASE("an ensemble of one simulation gives no verdict") {
  const AlignedBytes bytes = seen_plates_model(1, 8);
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  for (const double angle : {0.1, 0.33, 0.9}) {
    const MatchResult result = matcher.match({.points = seen(bent(angle))});
    REQUIRE(result.status == Status::ok);
    CHECK(result.verdict == Verdict::unknown);
    CHECK(std::isnan(result.fit.misfit));
  }
}

// Such frames were called `no simulation fits`: the limits came from frames at stored states.
TEST_CASE("a run of the ensemble fits between its states, however far apart these are") {
  for (const std::uint32_t steps : {4u, 5u, 8u}) {
    CAPTURE(steps);
    const AlignedBytes bytes = seen_plates_model(6, steps);
    const Model model = Model::view(bytes.span());
    Matcher matcher(model, fit_config());
    for (double angle = 0; angle < 0.75; angle += 0.05) {
      CAPTURE(angle);
      CHECK(matcher.match({.points = seen(bent(angle))}).verdict != Verdict::no_simulation_fits);
    }
  }
}

// Regression: every hidden cell of such a frame counted as a hole in the component, so that no simulation fitted it,
// and the tracker, for which all candidates were equally likely, did not change.
TEST_CASE("a hidden third of the surface changes neither the match nor the verdict, only the coverage") {
  const AlignedBytes bytes = seen_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  const std::uint32_t s = 8 * 3 + 5;
  const auto positions = model.node_positions(s);
  std::vector<Point> points = seen({positions.begin(), positions.end()});
  const MatchResult whole = matcher.match({.points = points});
  const float misfit = whole.fit.misfit, coverage = whole.coverage;
  std::erase_if(points, [](const Point& p) { return p.x > -40 && p.x < 20; });
  const MatchResult part = matcher.match({.points = points});
  REQUIRE(part.status == Status::ok);
  CHECK(part.coverage < coverage - 0.2f);
  CHECK(part.matches[0].sample == model.sample(s));
  CHECK(part.verdict == Verdict::matched);
  CHECK(part.fit.misfit < 1.1f * misfit);
}

TEST_CASE("an ensemble in m was judged with lengths in mm: full coverage, and no simulation fitted") {
  struct Judged {
    std::vector<Status> statuses;
    std::vector<Verdict> verdicts;
    std::vector<std::uint32_t> samples;
    std::vector<float> coverages, misfits;
    std::size_t culled = 0;
    Verdict test = Verdict::unknown;
  };
  const auto judged = [](const std::string& unit) {
    const auto scale = static_cast<float>(units_per_mm(unit));
    EnsembleDescription description = bent_plates_description();
    description.length_unit = unit;
    const TemporaryFolder folder;
    const PlateShape shape{.length = 190 * scale, .width = 90 * scale};
    bake_model(similar_plates(6, 8, shape), description, folder / "m.lbea", with_views(0, scale));
    const Model model = Model::open(folder / "m.lbea");
    MatcherConfig config = fit_config();
    config.T_reference_sensor = rig_above(scale).T_reference_sensor;
    Matcher matcher(model, config);
    Tracker tracker(model);
    Judged all;
    const auto match = [&](const std::vector<Point>& frame) {
      std::vector<Point> points = frame;
      for (Point& p : points) p = {scale * p.x, scale * p.y, scale * p.z};
      const MatchResult result = matcher.match({.points = points});
      all.statuses.push_back(result.status);
      all.verdicts.push_back(result.verdict);
      all.samples.push_back(result.matches.empty() ? 0 : model.sample_index(result.matches[0].sample));
      all.coverages.push_back(result.coverage);
      all.misfits.push_back(result.fit.misfit);
      all.culled += result.points.culled;
      return result;
    };
    for (const double angle : {0.1, 0.25, 0.4, 0.55, 0.72, 0.8})
      all.test = tracker.update(match(seen(bent(angle), {.sigma = 0.3f}))).verdict;
    auto folded = bent(0.6);
    for (std::size_t i = 0; i < folded.size(); i += 3) folded[i + 2] += 12.0f * std::sin(folded[i] * 0.1f);
    match(seen(folded));
    std::vector<Point> part = seen(bent(0.6)), far = part;
    std::erase_if(part, [](const Point& p) { return p.x > -70; });
    match(part);
    for (Point& p : far) p.z += 60;
    match(far);
    return all;
  };
  const Judged mm = judged("mm"), m = judged("m");
  CHECK(mm.verdicts[0] == Verdict::matched);
  CHECK(mm.verdicts[6] == Verdict::no_simulation_fits);
  CHECK(mm.statuses[7] == Status::low_coverage);
  CHECK(mm.test == Verdict::matched);
  CHECK(m.statuses == mm.statuses);
  CHECK(m.verdicts == mm.verdicts);
  CHECK(m.samples == mm.samples);
  CHECK(m.test == mm.test);
  CHECK(m.culled == mm.culled);
  for (std::size_t i = 0; i < mm.coverages.size(); ++i) {
    CHECK(m.coverages[i] == doctest::Approx(mm.coverages[i]).epsilon(0.01));  // two of 200 vertices, by rounding
    if (mm.misfits[i] > 0) CHECK(m.misfits[i] == doctest::Approx(mm.misfits[i]).epsilon(0.01));
  }
}
