// Several rigs through the C interface: the same bits as in C++.
#include "tests/runtime/rigs/two_rigs.hpp"

#include <lbea/lbea.h>
#include <lbea/forecast.hpp>
#include <lbea/tracker.hpp>

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <thread>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

AlignedBytes model_of_both() {
  const TemporaryFolder folder;
  const auto rendering = [](const StereoSensor& rig) {
    return [rig](const CommonMesh& mesh, const std::array<float, 3>& low, const std::array<float, 3>& high) {
      return make_depth_renderer(rig, mesh.node_ids.size(), mesh.elements, low, high);
    };
  };
  BakeOptions options;
  options.depth_renderer = rendering(rig_above());
  options.more_depth_renderers = {rendering(rig_below())};
  bake_model(similar_plates(6, 8), bent_plates_description(), folder / "both.lbea", options);
  return AlignedBytes(folder / "both.lbea");
}

lbea_rig to_c(const Rig& rig) {
  lbea_rig c{};
  c.struct_size = sizeof c;
  std::ranges::copy(rig.T_reference_sensor, c.T_reference_sensor);
  c.clock_offset_ns = rig.clock_offset_ns;
  return c;
}

lbea_frame to_c(const Frame& frame) {
  return {sizeof(lbea_frame), frame.id, frame.stamp_ns, reinterpret_cast<const lbea_point*>(frame.points.data()),
          frame.points.size()};
}

template <typename T>
T sized() {
  T empty{};
  empty.struct_size = sizeof empty;
  return empty;
}

bool is_same(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

void check_same(const lbea_result& c, const MatchResult& result, const Model& model) {
  REQUIRE(c.status == static_cast<int>(result.status));  // of frames: the same numbers
  CHECK(static_cast<int>(c.verdict) == static_cast<int>(result.verdict));
  CHECK(c.frame_id == result.frame_id);
  CHECK(c.stamp_ns == result.stamp_ns);
  CHECK(c.points_used == result.points.used);
#define LBEA_SAME(name) CHECK(is_same(c.name, result.fit.name));
  LBEA_FIT_NUMBERS(LBEA_SAME)
#undef LBEA_SAME
  CHECK(is_same(c.coverage, result.coverage));
  CHECK(std::ranges::equal(std::span(c.coefficients, c.coefficient_count), result.coefficients));
  REQUIRE(c.match_count == result.matches.size());
  REQUIRE(c.candidate_count == result.fit.candidates.size());
  REQUIRE(c.estimate_count == result.fit.estimate.size());
  const auto same = [&](const lbea_match& a, const Match& b) {
    return a.sample == model.sample_index(b.sample) && is_same(a.distance, b.distance);
  };
  CHECK(std::ranges::equal(std::span(c.matches, c.match_count), result.matches, same));
  CHECK(std::ranges::equal(std::span(c.candidates, c.candidate_count), result.fit.candidates, same));
  for (std::size_t i = 0; i < result.fit.estimate.size(); ++i) {
    CHECK(c.estimate[i].sample == model.sample_index(result.fit.estimate[i].sample));
    CHECK(is_same(c.estimate[i].weight, result.fit.estimate[i].weight));
  }
}

void check_same(const lbea_rig_matcher* c_matcher, const RigMatcher& matcher) {
  for (std::uint32_t rig = 0; rig < matcher.rigs().size(); ++rig) {
    CAPTURE(rig);
    const RigResult& result = matcher.rigs()[rig];
    auto c = sized<lbea_rig_result>();
    REQUIRE(lbea_rig_matcher_get_rig(c_matcher, rig, &c) == LBEA_OK);
    CHECK(c.status == static_cast<int>(result.status));
    CHECK(static_cast<int>(c.verdict) == static_cast<int>(result.verdict));
    CHECK((c.is_used != 0) == result.is_used);
    CHECK(c.points_received == result.points.received);
    CHECK(c.points_invalid == result.points.invalid);
    CHECK(c.points_culled == result.points.culled);
    CHECK(c.points_used == result.points.used);
    CHECK(c.clock_correction_ns == result.clock_correction_ns);
#define LBEA_SAME(name) CHECK(is_same(c.name, result.name));
    LBEA_FRAME_NUMBERS(LBEA_SAME)
    LBEA_FIT_NUMBERS(LBEA_SAME)
#undef LBEA_SAME
    CHECK(std::ranges::equal(c.pose_correction, matcher.pose_correction(rig)));
  }
}

/// A test of two rigs, the second of which has another clock, in C++ and in C.
struct Both {
  Both() {
    REQUIRE(lbea_model_open_memory(bytes.span().data(), bytes.span().size(), &c_model) == LBEA_OK);
    const std::array c_rigs{to_c(rigs[0]), to_c(rigs[1])};
    REQUIRE(lbea_rig_matcher_create(c_model, nullptr, c_rigs.data(), 2, &c_matcher) == LBEA_OK);
  }
  ~Both() {
    lbea_rig_matcher_destroy(c_matcher);
    lbea_model_close(c_model);
  }
  Both(const Both&) = delete;
  Both& operator=(const Both&) = delete;

  AlignedBytes bytes = model_of_both();
  Model model = Model::view(bytes.span());
  std::vector<Rig> rigs{{rig_above().T_reference_sensor}, {rig_below().T_reference_sensor, {}, -5'000'000'000}};
  RigMatcher matcher{model, MatcherConfig{}, rigs};
  lbea_model* c_model = nullptr;
  lbea_rig_matcher* c_matcher = nullptr;

  [[nodiscard]] std::array<std::vector<Point>, 2> clouds(std::uint32_t sample) const {
    return {seen_from(rig_above(), positions_of(model, sample)),
            seen_from(rig_below(), positions_of(model, sample), 2)};
  }
  static std::array<Frame, 2> frames(std::uint32_t ms, const std::array<std::vector<Point>, 2>& clouds) {
    return {at(ms, clouds[0]), at(5'000 + ms, clouds[1])};
  }
};

}  // namespace

TEST_CASE("in C, captures of two rigs, with gaps, give the bits that they give in C++, as do tracker and forecast") {
  Both both;
  Tracker tracker(both.model);
  Forecast forecast(both.model);
  lbea_tracker* c_tracker = nullptr;
  lbea_forecast* c_forecast = nullptr;
  REQUIRE(lbea_tracker_create(both.c_model, &c_tracker) == LBEA_OK);
  REQUIRE(lbea_forecast_create(both.c_model, &c_forecast) == LBEA_OK);
  for (std::uint32_t ms = 0; ms < 8; ++ms) {
    CAPTURE(ms);
    auto clouds = both.clouds(16 + ms);
    if (ms == 3) clouds[0].clear();
    if (ms == 4) clouds[1].clear();
    if (ms == 5) clouds = {};
    const auto frames = Both::frames(ms, clouds);
    const std::array c_frames{to_c(frames[0]), to_c(frames[1])};
    const MatchResult result = both.matcher.match(frames);
    auto c = sized<lbea_result>();
    CHECK(lbea_rig_matcher_match(both.c_matcher, c_frames.data(), 2, &c) == static_cast<int>(result.status));
    check_same(c, result, both.model);
    check_same(both.c_matcher, both.matcher);
    auto c_state = sized<lbea_test_state>();
    auto c_end = sized<lbea_forecast_state>();
    REQUIRE(lbea_tracker_update_by_rigs(c_tracker, both.c_matcher, &c_state) == LBEA_OK);
    REQUIRE(lbea_forecast_update_by_rigs(c_forecast, both.c_matcher, &c_end) == LBEA_OK);
    const TestState& state = tracker.update(result);
    forecast.update(result);
    CHECK(c_state.frames == state.frames);
    CHECK(is_same(c_state.sample_probability, state.sample_probability));
    CHECK(static_cast<int>(c_state.verdict) == static_cast<int>(state.verdict));
    CHECK(c_end.frames == forecast.state().frames);
    CHECK(std::ranges::equal(std::span(c_end.run_weights, c_end.run_count), forecast.state().run_weights));
  }
  CHECK(tracker.state().frames > 4);
  CHECK(forecast.state().frames > 4);
  CHECK(both.matcher.rigs()[0].is_used);
  CHECK(both.matcher.rigs()[1].is_used);
  lbea_forecast_destroy(c_forecast);
  lbea_tracker_destroy(c_tracker);
}

TEST_CASE("in C, two steps by two threads, fixed poses, a known impact and a reset do what they do in C++") {
  Both both;
  both.matcher.fix_poses();
  lbea_rig_matcher_fix_poses(both.c_matcher);
  both.matcher.set_impact(500'000);
  lbea_rig_matcher_set_impact(both.c_matcher, 500'000);
  for (std::uint32_t ms = 0; ms < 4; ++ms) {
    CAPTURE(ms);
    const auto clouds = both.clouds(9 + ms);
    const auto frames = Both::frames(ms, clouds);
    const lbea_frame first = to_c(frames[0]), second = to_c(frames[1]);
    std::thread other([&] { CHECK(lbea_rig_matcher_match_alone(both.c_matcher, 1, &second) == LBEA_OK); });
    CHECK(lbea_rig_matcher_match_alone(both.c_matcher, 0, &first) == LBEA_OK);
    other.join();
    auto c = sized<lbea_result>();
    CHECK(lbea_rig_matcher_combine(both.c_matcher, &c) == LBEA_OK);
    check_same(c, both.matcher.match(frames), both.model);
    check_same(both.c_matcher, both.matcher);
    CHECK(c.test_time == doctest::Approx(1e-3 * ms - 0.5e-3));
    CHECK(std::isnan(c.pose_shift));
    if (ms != 1) continue;
    both.matcher.reset();
    lbea_rig_matcher_reset(both.c_matcher);
    check_same(both.c_matcher, both.matcher);
  }
}
