// All pipelines find the same matches; measurements are complete and consistent.
#include "tests/bench/plates.hpp"
#include "tools/bench/measurement.hpp"

#include <doctest/doctest.h>

#include <string>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;
using namespace lbea::tool::bench;
using lbea::test::Plates;

TEST_CASE("the product and every baseline pass the same check, by both methods") {
  Plates plates;
  plates.points[5] = {1e9f, 0, 0};  // outside the envelope
  plates.points[6].y = std::numeric_limits<float>::quiet_NaN();
  for (const Method method : {Method::lbea, Method::vtp}) {
    plates.config.method = method;
    AnswerCheck check(plates.task(), plates.points);
    for (const auto& pipeline : plates.pipelines()) {
      CAPTURE(pipeline->name());
      CHECK(check.disagreement(pipeline->answer(plates.frame)).value_or("right") == "right");
    }
  }
}

TEST_CASE("answers for one cloud are wrong for another") {
  Plates plates;
  const std::vector<Point> other = plates.measured(20, 4'000);
  AnswerCheck check(plates.task(), other);
  for (const auto& pipeline : plates.pipelines()) CHECK(check.disagreement(pipeline->answer(plates.frame)).has_value());
}

TEST_CASE("every pipeline is timed on every cloud in turn, and the stages take at most the total time") {
  const Plates plates;
  const std::vector<BenchCloud> clouds{{"a", 0, plates.points}, {"b", 0, plates.measured(3, 500)}};
  std::uint64_t last = 0;
  const auto pipelines = plates.pipelines();
  const auto measurements =
      measure(pipelines, clouds, {.frames = 5, .warm_up = 2}, [&](std::uint64_t done) { last = done; });
  CHECK(last == 7);
  REQUIRE(measurements.size() == pipelines.size());
  for (const Measurement& m : measurements) {
    CAPTURE(m.pipeline);
    REQUIRE(m.frames.size() == 5);
    for (std::size_t i = 0; i < 5; ++i) CHECK(m.frames[i].cloud == i % 2);
    for (const FrameTimes& frame : m.frames) {
      std::uint64_t stages = 0;
      for (std::size_t stage = 0; stage < total_stage; ++stage) stages += frame.ns[stage];
      CHECK(stages > 0);
      CHECK(stages <= frame.ns[total_stage]);
    }
    CHECK(m.stage_us(total_stage).count == 5);
    CHECK(m.frames_per_second() == doctest::Approx(1e6 / m.stage_us(total_stage).mean));
  }
}

TEST_CASE("ratios compare the medians of one stage") {
  const auto measured = [](std::vector<std::uint64_t> totals) {
    Measurement m;
    for (const std::uint64_t total : totals) {
      m.frames.push_back({});
      m.frames.back().ns[total_stage] = total;
      m.frames.back().ns[processor_stage] = 500;
    }
    return m;
  };
  CHECK(ratio(measured({9'000, 8'000, 1'000}), measured({2'000, 9'000, 1'000}), total_stage) == 4);
  CHECK(ratio(measured({9'000}), measured({2'000}), processor_stage) == 1);
}

TEST_CASE("kernels are selected by their short names; an unknown name is refused with the list of names") {
  CHECK(short_name(kernels_named("baseline")) == "baseline");
  CHECK_THROWS_WITH_AS(static_cast<void>(kernels_named("abacus")), doctest::Contains("baseline"), Error);
}
