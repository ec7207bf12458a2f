#include "runtime/src/model/model_view.hpp"
#include "tests/runtime/frames.hpp"
#include "tests/support/refusals.hpp"
#include "tests/support/synthetic_model.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr auto both_modes = {ReferenceMode::impact, ReferenceMode::over_time};
constexpr auto both_methods = {Method::lbea, Method::vtp};

std::int64_t stamp_of(const Model& model, std::uint32_t sample) {
  return static_cast<std::int64_t>(model.sample_time_s(sample) * 1e9 + 0.5);
}

// Plates of different runs bend through the same shapes at different times: all that equal the frame are right.
bool same_shape(const Model& model, Sample a, std::uint32_t b) {
  const auto p = model.node_positions(model.sample_index(a)), q = model.node_positions(b);
  return std::ranges::equal(p, q, [](float x, float y) { return std::abs(x - y) < 1e-3f; });
}

}  // namespace

TEST_CASE("a baked sample finds itself, at distance about 0 and wholly covered") {
  for (const ReferenceMode mode : both_modes) {
    const AlignedBytes bytes = bent_plates_model(mode);
    const Model model = Model::view(bytes.span());
    for (const Method method : both_methods) {
      Matcher matcher(model, {.method = method});
      for (std::uint32_t s = 0; s < model.samples(); ++s) {
        CAPTURE(s);
        const auto points = points_of(model, s);
        const MatchResult result = matcher.match({.id = s, .stamp_ns = stamp_of(model, s), .points = points});
        CHECK(result.status == Status::ok);
        CHECK(result.frame_id == s);
        CHECK(result.coverage == doctest::Approx(1));
        CHECK(result.points.used == points.size());
        REQUIRE(result.matches.size() == 5);
        CHECK(same_shape(model, result.matches[0].sample, s));
        // Coefficients reach 2e4 here and carry float rounding of their 20 sums; the next sample is much farther.
        CHECK(result.matches[0].distance < 1.0f);
        CHECK(std::ranges::is_sorted(result.matches, {}, &Match::distance));
        for (const Match& match : result.matches)
          if (!same_shape(model, match.sample, s)) CHECK(match.distance > 10 * result.matches[0].distance);
      }
    }
  }
}

TEST_CASE("coefficients of a baked sample are its row of S_proj") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model);
  const ReferenceView& reference = model.view().references[0];
  const std::size_t stride = format::padded(model.modes());
  for (const std::uint32_t s : {0u, 7u, 23u}) {
    const auto points = points_of(model, s);
    const MatchResult result = matcher.match({.points = points});
    REQUIRE(result.coefficients.size() == std::size_t{3} * model.modes());
    for (std::size_t j = 0; j < model.modes(); ++j)
      for (std::size_t axis = 0; axis < 3; ++axis)
        CHECK(result.coefficients[3 * j + axis] ==
              doctest::Approx(reference.coefficients[(3 * s + axis) * stride + j]).epsilon(1e-5).scale(1e4));
  }
}

TEST_CASE("more noise, more distance") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  for (const Method method : both_methods) {
    Matcher matcher(model, {.method = method});
    float before = 0;
    for (const float sigma : {0.05f, 0.5f, 5.0f}) {
      std::mt19937 random(3);
      std::normal_distribution<float> noise(0, sigma);
      auto points = points_of(model, 17);
      for (Point& p : points) p = {p.x + noise(random), p.y + noise(random), p.z + noise(random)};
      const MatchResult result = matcher.match({.points = points});
      CHECK(result.matches[0].distance > before);
      before = result.matches[0].distance;
      if (sigma < 1) CHECK(model.sample_index(result.matches[0].sample) == 17);
    }
  }
}

TEST_CASE("frames that cannot be matched say why, and the next one is matched again") {
  constexpr float nan = std::numeric_limits<float>::quiet_NaN();
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, {.max_points = 1'000});
  const auto good = points_of(model, 9);
  const auto expect_good = [&] {
    const MatchResult result = matcher.match({.points = good});
    CHECK(result.status == Status::ok);
    CHECK(model.sample_index(result.matches[0].sample) == 9);
  };

  SUBCASE("empty") {
    const MatchResult result = matcher.match({.id = 4, .stamp_ns = 5});
    CHECK(result.status == Status::empty_frame);
    CHECK(result.matches.empty());
    CHECK(result.frame_id == 4);
    CHECK(result.stamp_ns == 5);
  }
  SUBCASE("all NaN") {
    const std::vector<Point> points(50, Point{nan, nan, nan});
    const MatchResult result = matcher.match({.points = points});
    CHECK(result.status == Status::empty_frame);
    CHECK(result.points.invalid == 50);
    CHECK(result.points.used == 0);
  }
  SUBCASE("one point") {
    const MatchResult result = matcher.match({.points = std::span(good).first(1)});
    CHECK(result.status == Status::low_coverage);
    CHECK(result.points.used == 1);
    CHECK(result.matches.size() == 5);
    CHECK(result.coverage < 0.1f);
  }
  SUBCASE("too many points are refused, not cut short") {
    const std::vector<Point> points(1'001, good[0]);
    const MatchResult result = matcher.match({.points = points});
    CHECK(result.status == Status::too_many_points);
    CHECK(result.points.received == 1'001);
    CHECK(result.matches.empty());
    CHECK(matcher.match({.points = std::span(points).first(1'000)}).status == Status::low_coverage);
  }
  SUBCASE("a metre away") {
    auto points = good;
    for (Point& p : points) p.y += 1'000;
    const MatchResult result = matcher.match({.points = points});
    CHECK(result.status == Status::empty_frame);
    CHECK(result.points.culled == points.size());
  }
  SUBCASE("half of the surface unseen") {
    std::vector<Point> points;
    for (const Point& p : good)
      if (p.y < 22) points.push_back(p);  // the first three of ten rows
    const MatchResult result = matcher.match({.points = points});
    CHECK(result.coverage < 0.4f);
    CHECK(result.coverage > 0.2f);
  }
  expect_good();
}

TEST_CASE("background is culled and does not change the match") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  Matcher matcher(model);
  auto points = points_of(model, 20);
  const MatchResult clean = matcher.match({.points = points});
  const std::vector<Match> expected(clean.matches.begin(), clean.matches.end());
  const std::size_t count = points.size();
  for (int i = 0; i < 500; ++i) points.push_back({static_cast<float>(i), 45, -400});
  const MatchResult result = matcher.match({.points = points});
  CHECK(result.points.culled == 500);
  CHECK(result.points.used == count);
  REQUIRE(result.matches.size() == expected.size());
  for (std::size_t k = 0; k < expected.size(); ++k) {
    CHECK(result.matches[k].sample == expected[k].sample);
    CHECK(result.matches[k].distance == expected[k].distance);
  }
}

TEST_CASE("sensor coordinates: the pose is applied") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  const RigidTransform T{0, -1, 0, 300, 0, 0, 1, -20, -1, 0, 0, 500};  // T_reference_sensor, a proper rotation
  Matcher matcher(model, {.T_reference_sensor = T});
  auto points = points_of(model, 22);
  for (Point& p : points) {  // to sensor coordinates: R' (p - t)
    const Point d{p.x - T[3], p.y - T[7], p.z - T[11]};
    p = {T[0] * d.x + T[4] * d.y + T[8] * d.z, T[1] * d.x + T[5] * d.y + T[9] * d.z,
         T[2] * d.x + T[6] * d.y + T[10] * d.z};
  }
  const MatchResult result = matcher.match({.points = points});
  CHECK(result.status == Status::ok);
  CHECK(same_shape(model, result.matches[0].sample, 22));
}

TEST_CASE("over time, the reference is the one stored nearest to the time since the trigger") {
  const AlignedBytes bytes = bent_plates_model(ReferenceMode::over_time);
  const Model model = Model::view(bytes.span());
  REQUIRE(model.references() == 6);
  const double step = model.reference_time_s(1) - model.reference_time_s(0);
  constexpr std::int64_t trigger_ns = 1'700'000'000'000'000'000;
  Matcher matcher(model, {.trigger_ns = trigger_ns});
  const auto points = points_of(model, 3);
  const auto reference_for = [&](double steps_after_trigger) {
    return matcher
        .match({.stamp_ns = trigger_ns + static_cast<std::int64_t>(steps_after_trigger * step * 1e9), .points = points})
        .reference;
  };
  CHECK(reference_for(-3) == 0);
  CHECK(reference_for(0) == 0);
  CHECK(reference_for(0.49) == 0);
  CHECK(reference_for(0.51) == 1);
  CHECK(reference_for(3.4) == 3);
  CHECK(reference_for(4.6) == 5);
  CHECK(reference_for(400) == 5);
  for (const std::int64_t hostile :
       {std::numeric_limits<std::int64_t>::min(), std::numeric_limits<std::int64_t>::max()})
    CHECK(matcher.match({.stamp_ns = hostile, .points = points}).reference == (hostile < 0 ? 0 : 5));
}

TEST_CASE("configurations that make no sense are refused in words") {
  const AlignedBytes bytes = bent_plates_model();
  const Model model = Model::view(bytes.span());
  const auto refuses = [&](const MatcherConfig& config, const char* word) {
    check_error(error_of([&] { Matcher matcher(model, config); }), Status::bad_config, {word});
  };
  refuses({.max_points = 0}, "max_points");
  refuses({.max_matches = 0}, "max_matches");
  refuses({.trusted_distance = -1}, "trusted_distance");
  refuses({.trusted_distance = std::numeric_limits<float>::infinity()}, "trusted_distance");
  refuses({.min_coverage = 1.5f}, "min_coverage");
  refuses({.min_coverage = std::nanf("")}, "min_coverage");
  refuses({.method = static_cast<Method>(17)}, "method");
  refuses({.T_reference_sensor = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, -1, 0}}, "T_reference_sensor");  // a mirror
  refuses({.T_reference_sensor = {2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0}}, "T_reference_sensor");   // a scale
  refuses({.T_reference_sensor = {}}, "T_reference_sensor");
}

TEST_CASE("asked for more matches than there are samples, it returns all samples") {
  const AlignedBytes bytes = bent_plates_model(ReferenceMode::impact, {.runs = 1, .steps = 2});
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, {.max_matches = 100});
  const auto points = points_of(model, 1);
  CHECK(matcher.match({.points = points}).matches.size() == 2);
}
