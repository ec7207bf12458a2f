// Frames matched with the earlier ones of their test.
#include "runtime/src/fit/test_history.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/track/stamps.hpp"

#include <lbea/test_history.hpp>

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::test;

namespace {

constexpr std::int64_t step_ns = millisecond / 2;  // between the states of the simulations

/// Sums over the frames of which something hides a part, in radians, by the frames alone and with the history.
struct AngleErrors {
  double alone = 0, with_history = 0;
};

/// Of plates that bend over `steps` steps; from those that is_hidden() chooses, only points up to `end` are seen.
template <class IsHidden>
AngleErrors angle_errors(std::uint32_t steps, float sigma, float end, const IsHidden& is_hidden) {
  const AlignedBytes bytes = seen_plates_model(6, 16);
  const Model model = Model::view(bytes.span());
  Matcher alone(model, fit_config()), matcher(model, fit_config());
  TestHistory history(model);
  AngleErrors errors;
  for (std::uint32_t step = 0; step < steps; ++step) {
    std::vector<Point> points = seen(bent(0.75 * step / 15), {.sigma = sigma}, step + 1);
    if (is_hidden(step)) std::erase_if(points, [end](const Point& p) { return p.x > end; });
    const Frame frame{step, step * step_ns, points};
    const MatchResult lone = alone.match(frame), informed = matcher.match(frame, history);
    if (!is_hidden(step)) continue;
    const auto off = [&](const MatchResult& result) {
      const auto [simulation, time_step] = result.matches[0].sample;
      return std::abs((0.5 + 0.1 * simulation) * time_step - 0.75 * step) / 15;
    };
    errors.alone += off(lone);
    errors.with_history += off(informed);
  }
  return errors;
}

// Radians per time step of the simulations that bend least and most.
constexpr double least_step = 0.5 / 15, most_step = 1.0 / 15;

}  // namespace

// The free end moves first and is never seen: what the frames show looks undeformed for long. The sample that leaves
// the least of it hidden, the most bent one, was taken for the frame.
TEST_CASE("what hides the part that moves is not taken for a deformation") {
  const auto always = [](std::uint32_t) { return true; };
  const AngleErrors errors = angle_errors(8, 0.5f, -55, always);
  CHECK(errors.alone < 8 * least_step);
  CHECK(errors.with_history < 8 * least_step);
  const AngleErrors by_noise = angle_errors(8, 4, -75, always);
  CHECK(by_noise.with_history < by_noise.alone / 2);
}

// What something hid was written beyond the end of the history's cells.
TEST_CASE("a history for depth images of another size is not used") {
  const AlignedBytes bytes = seen_plates_model(), without_images = bent_plates_model();
  const Model model = Model::view(bytes.span()), other = Model::view(without_images.span());
  Matcher matcher(model, fit_config());
  TestHistory history(other);
  for (std::uint32_t step = 1; step < 8; ++step) {
    std::vector<Point> points = seen(bent(0.1 * step), {}, step);
    std::erase_if(points, [](const Point& p) { return p.x > 0; });
    const Frame frame{step, step * step_ns, points};
    const float alone = matcher.match(frame).fit.residual;
    const MatchResult result = matcher.match(frame, history);
    CHECK(result.fit.residual == alone);
    CHECK(std::isnan(result.fit.test_time));
  }
}

// It keeps numbers of samples: those of a model with fewer of them were read beyond their end.
TEST_CASE("a history of another model is not used") {
  const AlignedBytes bytes = seen_plates_model(6, 8), more_bytes = seen_plates_model(6, 16);
  const Model model = Model::view(bytes.span()), more = Model::view(more_bytes.span());
  Matcher matcher(model, fit_config()), of_more(more, fit_config());
  TestHistory history(more);
  for (std::uint32_t step = 0; step < 10; ++step) {
    const std::vector<Point> points = seen(bent(0.75 * step / 15), {.sigma = 0.5f}, step + 1);
    const Frame frame{step, step * step_ns, points};
    const bool knows_time = std::isfinite(of_more.match(frame, history).fit.test_time);
    if (step > 4) REQUIRE(knows_time);
    CHECK(std::isnan(matcher.match(frame, history).fit.test_time));
  }
}

// The undeformed component explained them as well as any other shape, so that the test, which begins in the middle of
// the crash, counted as one that begins undeformed.
TEST_CASE("a few points at the beginning of a test do not tell what it begins with") {
  const AlignedBytes bytes = seen_plates_model(6, 16);
  const Model model = Model::view(bytes.span());
  Matcher matcher(model, fit_config());
  TestHistory history(model), without_them(model);
  history.fix_pose();
  without_them.fix_pose();
  const auto frame_at = [](std::uint32_t step, float end, std::vector<Point>& points) {
    points = seen(bent(0.75 * step / 15), {.sigma = 0.5f}, step + 1);
    std::erase_if(points, [end](const Point& p) { return p.x > end; });
    return Frame{step, step * step_ns, points};
  };
  std::vector<Point> points;
  for (std::uint32_t step = 4; step < 7; ++step) {
    const Frame frame = frame_at(step, 0, points);
    REQUIRE(matcher.match({frame.id, frame.stamp_ns, frame.points.first(20)}, history).verdict == Verdict::unknown);
  }
  for (std::uint32_t step = 7; step < 14; ++step) {
    const Frame frame = frame_at(step, step == 7 ? 200.0f : -10.0f, points);
    const Sample expected = matcher.match(frame, without_them).matches[0].sample;
    CHECK(matcher.match(frame, history).matches[0].sample == expected);
  }
}

// Next to the edge about which the plates bend, all angles look alike up to the noise.
TEST_CASE("what a frame hides is known from an earlier one") {
  const auto one_of_four = [](std::uint32_t step) { return step % 4 == 3; };
  const AngleErrors errors = angle_errors(16, 0.5f, -65, one_of_four);
  CHECK(errors.alone < 4 * least_step);
  CHECK(errors.with_history < 4 * most_step);
  const AngleErrors by_noise = angle_errors(16, 2, -80, one_of_four);
  CHECK(by_noise.with_history < by_noise.alone / 2);
  CHECK(by_noise.with_history < 4 * most_step);
}

// Regression: the first frame was expected at the impact.
TEST_CASE("the first frame of a test may show any time where no samples are proposed by their images") {
  const AlignedBytes bytes = seen_plates_model(6, 16);
  const Model model = Model::view(bytes.span());
  DepthImages images = *SensorViews::baked_into(model).data();
  std::vector<std::uint16_t> depths(images.depths.begin(), images.depths.end());
  for (std::size_t begin = 0; begin < depths.size(); begin += padded_cells(images.camera))
    for (const std::uint32_t cell : thinned_cells(images)) depths[begin + cell] = empty_cell;
  images.depths = depths;
  SurfaceFitter fitter(model.view(), SensorViews(std::make_shared<const DepthImages>(images)), 1);
  REQUIRE(!fitter.search().proposes());
  std::vector<RankedSample> all;
  for (std::uint32_t s = 0; s < model.samples(); ++s) all.push_back({s, 0});
  CloudIndex index(envelope_grid(model.view().envelope), 200'000);
  const EnsembleTimes times = EnsembleTimes::of(model.view());
  const FrameExpectation first{0, {}, {}, {times.impact_s, 0.01 * times.duration_s * times.duration_s}, true};
  for (double angle = 0.05; angle < 1; angle += 0.1) {
    index.build(seen(bent(angle), {.sigma = 0.5f}, 3), rig_above().T_reference_sensor);
    static_cast<void>(fitter.fit(index, all));
    const Sample alone = fitter.search().candidates()[0].sample;
    static_cast<void>(fitter.fit(index, all, {nullptr, &first, nullptr}));
    CHECK(fitter.search().candidates()[0].sample == alone);
  }
}

TEST_CASE("the shape that a frame shows is kept with the samples nearest to it") {
  const AlignedBytes bytes = seen_plates_model(6, 16);
  const Model model = Model::view(bytes.span());
  SurfaceFitter fitter(model.view(), SensorViews::baked_into(model), 1, {});
  CloudIndex index(envelope_grid(model.view().envelope), 200'000);
  index.build(seen(bent(0.4)), rig_above().T_reference_sensor);
  const FrameExpectation nothing{};
  static_cast<void>(fitter.fit(index, {}, {nullptr, &nothing, nullptr}));
  const EarlierShape shown = shape_shown(5, fitter.estimate(), 4, 1);
  CHECK(shown.stamp_ns == 5);
  CHECK(shown.error == 2);
  REQUIRE(shown.similar_count == EarlierShape::most_similar);
  const auto angle = [](std::uint32_t sample) { return (0.5 + 0.1 * (sample / 16)) * (sample % 16) / 15; };
  for (const std::uint32_t sample : shown.similar) CHECK(std::abs(angle(sample) - 0.4) < 0.05);
  CHECK(std::abs(angle(shown.similar.front()) - 0.4) < 0.01);
}

// In a test of which one third was hidden throughout, no sample of the true deformation branch was among the proposals:
// what was seen of the last frames was more similar to 256 others.
TEST_CASE("where something hides a part, samples that continue the earlier frames are proposed, too") {
  const AlignedBytes bytes = seen_plates_model(6, 16);
  const Model model = Model::view(bytes.span());
  FitSettings few;
  few.proposals = few.candidates;
  SurfaceFitter fitter(model.view(), SensorViews::baked_into(model), 1, few);
  CloudIndex index(envelope_grid(model.view().envelope), 200'000);
  const auto propose = [&](float end, const EarlierShape& earlier) {
    std::vector<Point> points = seen(bent(0.5 * 12 / 15), {.sigma = 0.5f}, 1);
    std::erase_if(points, [end](const Point& p) { return p.x > end; });
    index.build(points, rig_above().T_reference_sensor);
    const FrameExpectation expected{0, {&earlier}};
    static_cast<void>(fitter.fit(index, {}, {nullptr, &expected, nullptr}));
    std::vector<std::uint32_t> proposed;
    for (const RankedSample& one : fitter.search().proposed()) proposed.push_back(one.sample);
    std::ranges::sort(proposed);
    CHECK(std::ranges::adjacent_find(proposed) == proposed.end());
    CHECK(proposed.size() <= few.proposals);
    return proposed;
  };
  const std::uint32_t before = 5 * 16 + 10, now = before + 4;  // of the plate that bends most
  const double age_s = model.view().sample_times[now] - model.view().sample_times[before];
  EarlierShape none = shape_at(-std::llround(1e9 * age_s)), similar = none;
  similar.similar = {before};
  similar.similar_count = 1;
  for (const std::uint32_t continued : {now - 1, now, now + 1}) {
    CHECK_FALSE(std::ranges::binary_search(propose(-65, none), continued));
    CHECK(std::ranges::binary_search(propose(-65, similar), continued));
  }
  REQUIRE(fitter.search().image().is_hidden);
  CHECK(propose(500, similar) == propose(500, none));  // the image tells
}
