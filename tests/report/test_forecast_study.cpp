// Forecasts of the report beside what came, on bending plates.
#include "tests/support/synthetic_model.hpp"
#include "tools/report/content/forecast_study.hpp"
#include "tools/shared/matching/shapes.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

constexpr std::uint32_t last_step = 5;

struct Plates {
  AlignedBytes bytes = bent_plates_model();
  Model model = Model::view(bytes.span());
  [[nodiscard]] double duration() const {
    return model.sample_time_s(model.sample_index({0, last_step})) - model.sample_time_s(model.sample_index({0, 0}));
  }
  [[nodiscard]] std::span<const float> end_of(std::uint32_t run) const {
    return model.node_positions(model.sample_index({run, last_step}));
  }
};

/// A frame that shows `step` of a run, and forecasts the end as this combination of runs.
RecordedFrame frame_of(const Plates& plates, Sample shown, std::vector<wire::RunWeight> runs) {
  wire::WireResult result;
  result.matches = {{shown, "", 0, 1}};
  result.fit.candidates = {{shown, 1}};
  result.fit.estimate = {{shown, 1.0f}};
  result.fit.test_time = static_cast<float>(plates.duration() * shown.time_step / last_step);
  result.forecast = {1, 7.5f, std::move(runs), {}, {}};
  return {result, {}};
}

ForecastStudy study_of(const Plates& plates, std::vector<RecordedFrame> frames) {
  std::vector<ChosenFrame> chosen;
  std::map<CaptureKey, RecordedFrame> recorded;
  for (std::size_t i = 0; i < frames.size(); ++i) {
    chosen.push_back({{1, i}, static_cast<double>(i)});
    recorded[{1, i}] = std::move(frames[i]);
  }
  return study_forecasts(plates.model, chosen, recorded);
}

}  // namespace

TEST_CASE("the error of a forecast is the mean distance of its final shape from what came") {
  const Plates plates;
  const ForecastStudy study = study_of(
      plates, {frame_of(plates, {1, 1}, {{0, 1.0f}}),  //
               frame_of(plates, {1, 3}, {{0, 0.5f}, {1, 0.5f}}), frame_of(plates, {1, last_step}, {{1, 1.0f}})});
  REQUIRE(study.moments.size() == 3);
  CHECK(study.is_compared());
  double sum = 0;
  const auto a = plates.end_of(0), b = plates.end_of(1);
  for (std::size_t i = 0; i < a.size(); i += 3)
    sum += std::hypot(double{a[i]} - b[i], double{a[i + 1]} - b[i + 1], double{a[i + 2]} - b[i + 2]);
  const double apart = 3 * sum / static_cast<double>(a.size());
  REQUIRE(apart > 1);
  CHECK(study.moments[0].distance == doctest::Approx(apart).epsilon(1e-5));
  CHECK(study.moments[1].distance == doctest::Approx(apart / 2).epsilon(1e-4));
  CHECK(study.moments[2].distance == doctest::Approx(0));
  CHECK(study.moments[0].error_90 == 7.5);
  CHECK(study.moments[0].share == doctest::Approx(0.2));
  CHECK(study.moments[0].element_distances.size() == plates.model.elements());
  // The first one after 10 % and 20 %, and the first after half of the duration.
  CHECK(study.moments[0].is_shown);
  CHECK(study.moments[1].is_shown);
  CHECK_FALSE(study.moments[2].is_shown);
}

TEST_CASE("a test that ends early is not compared with the end of the simulations") {
  const Plates plates;
  const ForecastStudy study =
      study_of(plates, {frame_of(plates, {1, 1}, {{0, 1.0f}}), frame_of(plates, {1, 3}, {{1, 1.0f}})});
  REQUIRE(study.moments.size() == 2);
  CHECK_FALSE(study.is_compared());
  CHECK(study.end_share == doctest::Approx(0.6));
  for (const ForecastMoment& moment : study.moments) {
    CHECK(std::isnan(moment.distance));
    CHECK(moment.element_distances.empty());
    CHECK(moment.positions.size() == 3 * std::size_t{plates.model.nodes()});
  }
}

TEST_CASE("results of another model, without forecasts, and not recorded ones give no moment") {
  const Plates plates;
  const float nan = std::numeric_limits<float>::quiet_NaN();
  RecordedFrame none = frame_of(plates, {1, 2}, {});
  none.result->forecast = {};
  CHECK(study_of(plates, {frame_of(plates, {1, 2}, {{99, 1.0f}}), frame_of(plates, {1, 2}, {{0, nan}}),
                          frame_of(plates, {1, 2}, {{0, 1e9f}}), frame_of(plates, {1, 2}, {}), none, RecordedFrame{}})
            .moments.empty());
}
