// Forecasts of tests, frame by frame.
#include "runtime/src/forecast/learned_forecast.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tools/shared/matching/match_engine.hpp"

#include <lbea/lbea.h>
#include <lbea/forecast.hpp>
#include <lbea/test_history.hpp>

#include <doctest/doctest.h>

#include <cmath>
#include <numeric>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;
using format::SectionId;

namespace {

constexpr std::uint32_t runs = 12, steps = 11;

/// Plates that bend to 0.5, 0.6, ... radians in 5 ms; the second parameter has no effect.
void bake_plates(const std::filesystem::path& file) {
  Ensemble ensemble = similar_plates(runs, steps);
  ensemble.parameter_names = {"angle [rad]", "paint [-]"};
  for (std::uint32_t run = 0; run < runs; ++run)
    ensemble.runs[run].parameters = {0.5 + 0.1 * run, 7.0 * (run * 5 % 12)};
  EnsembleDescription description = bent_plates_description();
  description.channels = {{"end", ChannelKind::displacement, ChannelComponent::z, 0, {{true, 1020, {}}}, {}},
                          {"speed", ChannelKind::velocity, ChannelComponent::z, 150, {{true, 1020, {}}}, {}}};
  bake_model(ensemble, description, file, with_views());
}

AlignedBytes plates() {
  const TemporaryFolder folder;
  bake_plates(folder / "plates.lbea");
  return AlignedBytes(folder / "plates.lbea");
}

const Model& model() {
  static const AlignedBytes bytes = plates();
  static const Model baked = Model::view(bytes.span());
  return baked;
}

/// A frame that looks exactly like a sample.
struct Seen {
  std::array<WeightedSample, 1> estimate;
  MatchResult result;

  explicit Seen(std::uint32_t run, std::uint32_t step) : estimate{{{{run, step}, 1}}} {
    result.verdict = Verdict::matched;
    result.fit.estimate = estimate;
    result.fit.test_time = 0.0005f * static_cast<float>(step);
    result.fit.error_90 = 1;
  }
};

double sum(std::span<const float> values) { return std::accumulate(values.begin(), values.end(), 0.0); }

std::vector<float> weights(const TestForecast& forecast) {
  return {forecast.run_weights.begin(), forecast.run_weights.end()};
}

}  // namespace

TEST_CASE("a run that the ensemble lacks is foretold from half of it") {
  Matcher matcher(model(), fit_config());
  TestHistory history(model());
  history.set_impact(0);
  Forecast forecast(model());
  constexpr double angle = 1.25;  // between two runs
  const std::vector<float> truth = bent(angle);
  const double before = mean_distance(truth, final_positions(model(), forecast.state()));
  for (int step = 0; step <= 5; ++step) {
    const std::vector<Point> cloud = seen(bent(angle * step / (steps - 1)));
    forecast.update(matcher.match({static_cast<std::uint64_t>(step), step * 500'000, cloud}, history));
  }
  const TestForecast& now = forecast.state();
  CHECK(now.frames >= 4);
  const double error = mean_distance(truth, final_positions(model(), now));
  CHECK(error < 0.25 * before);
  CHECK(error <= double{now.error_90});
  CHECK(now.parameters[0].is_identifiable());
  CHECK(std::abs(double{now.parameters[0].value} - angle) <= double{now.parameters[0].bound_90});
  CHECK(double{now.parameters[0].bound_90} < 0.3);  // the runs' angles are within 1.1
  CHECK_FALSE(now.parameters[1].is_identifiable());
}

// A frame alone shows the speed of runs with its shape: the slow ones are later.
TEST_CASE("the speed of a test follows from how fast its shape changes") {
  // Twice the angle in the same time: half the way through, the shape of a slow run's end.
  constexpr std::uint32_t slow = 0, fast = 10;  // 0.5 and 1.5 rad
  Forecast forecast(model());
  CHECK(std::isnan(forecast.state().channels[1].value));
  for (std::uint32_t step = 0; step <= 6; ++step) forecast.update(Seen(fast, step).result);
  const auto value = [](std::uint32_t channel, std::uint32_t run, std::uint32_t step) {
    return double{model().channel_value(channel, model().sample_index({run, step}))};
  };
  const double truth = value(1, fast, 6), range = std::abs(truth - value(1, slow, 6));
  REQUIRE(range > 0);
  const TestForecast& now = forecast.state();
  REQUIRE(now.channels.size() == 2);
  CHECK(std::abs(double{now.channels[1].value} - truth) < 0.15 * range);
  CHECK(std::abs(double{now.channels[1].value} - truth) <= double{now.channels[1].bound_90});
  CHECK(std::abs(double{now.channels[0].final_value} - value(0, fast, steps - 1)) <=
        double{now.channels[0].final_bound_90});

  std::array<ChannelValue, 2> channels{{{1, 2}, {3, 4}}};
  replace_rates(model(), now, Seen(fast, 6).result.fit, channels);
  CHECK(channels[0].value == 1);  // no rate
  CHECK(channels[1].value == now.channels[1].value);
  CHECK(channels[1].bound_90 == now.channels[1].bound_90);
  channels = {{{1, 2}, {3, std::nanf("")}}};
  replace_rates(model(), now, Seen(fast, 6).result.fit, channels);
  CHECK(std::isnan(channels[1].bound_90));  // of a frame that no simulation explains
  channels = {{{1, 2}, {3, 4}}};
  replace_rates(model(), now, Seen(fast, 7).result.fit, channels);
  CHECK(channels[1].value == 3);  // the forecast lacks the frame
}

// Regression: the rates at the end of the simulations were given for all later frames.
TEST_CASE("rates are unknown when the simulations are over; those of a frame alone would be those at their end") {
  Forecast forecast(model());
  for (std::uint32_t step = 1; step < steps; ++step) forecast.update(Seen(4, step).result);
  CHECK(std::isfinite(forecast.state().channels[1].value));
  Seen later(4, steps - 1);
  later.result.fit.test_time = 0.0005f * (steps + 1);
  const TestForecast& now = forecast.update(later.result);
  CHECK(std::isnan(now.channels[1].value));
  CHECK(std::isfinite(now.channels[1].final_value));
  std::array<ChannelValue, 2> channels{{{1, 2}, {3, 4}}};
  replace_rates(model(), now, later.result.fit, channels);
  CHECK(channels[0].value == 1);
  CHECK(std::isnan(channels[1].value));
  CHECK(std::isnan(channels[1].bound_90));
}

// Regression: a component at rest had the speed of the runs' first samples, which the impact hits.
TEST_CASE("a frame of the undeformed component tells no speed") {
  for (const Method method : {Method::lbea, Method::vtp, Method::fit}) {
    MatcherConfig config = fit_config();
    config.method = method;
    Matcher matcher(model(), config);
    const std::vector<Point> at_rest = seen(bent(0)), deformed = seen(bent(0.5));
    const MatchResult before = matcher.match({1, 0, at_rest});
    REQUIRE(before.channels.size() == 2);
    CHECK(std::abs(before.channels[0].value) < 1);
    CHECK(std::isnan(before.channels[1].value));
    CHECK(std::isnan(before.channels[1].bound_90));
    CHECK(std::isfinite(matcher.match({2, 1, deformed}).channels[1].value));
  }
}

TEST_CASE("C programs get the channels of a forecast") {
  const TemporaryFolder folder;
  bake_plates(folder / "plates.lbea");
  lbea_model* opened = nullptr;
  lbea_forecast* forecast = nullptr;
  REQUIRE(lbea_model_open((folder / "plates.lbea").c_str(), &opened) == LBEA_OK);
  REQUIRE(lbea_forecast_create(opened, &forecast) == LBEA_OK);
  lbea_forecast_state state{};
  state.struct_size = sizeof(state);
  CHECK(lbea_forecast_update(forecast, nullptr, &state) == LBEA_OK);
  const Forecast same(model());
  REQUIRE(state.channel_count == 2);
  for (std::uint32_t c = 0; c < 2; ++c) {
    CHECK(std::isnan(state.channels[c].value));
    CHECK(std::isnan(state.channels[c].bound_90));
    CHECK(state.channels[c].final_value == same.state().channels[c].final_value);
    CHECK(state.channels[c].final_bound_90 == same.state().channels[c].final_bound_90);
    CHECK(state.channels[c].final_bound_90 > 0);
  }
  lbea_forecast_destroy(forecast);
  lbea_model_close(opened);
}

TEST_CASE("weights and probabilities add up to 1, before and after any frame") {
  Forecast forecast(model());
  for (std::uint32_t step = 0; step < steps; ++step) {
    const TestForecast& now = forecast.update(Seen(step % 3, step).result);
    CHECK(sum(now.run_weights) == doctest::Approx(1).epsilon(1e-4));
    CHECK(sum(now.branch_probabilities) == doctest::Approx(1).epsilon(1e-4));
  }
}

TEST_CASE("the bounds become narrower while a test is seen, by what it shows, not by the number of frames") {
  Forecast few(model()), many(model());
  const float nothing = few.state().error_90;
  for (std::uint32_t step = 1; step < steps; ++step) {
    few.update(Seen(6, step).result);
    for (int frame = 0; frame < 50; ++frame) many.update(Seen(6, step).result);
  }
  CHECK(few.state().error_90 < nothing);
  CHECK(many.state().error_90 == few.state().error_90);
  CHECK(many.state().frames == 50 * few.state().frames);
  for (std::uint32_t run = 0; run < runs; ++run)
    CHECK(many.state().run_weights[run] == doctest::Approx(few.state().run_weights[run]).epsilon(1e-3).scale(1));
}

TEST_CASE("frames without a time, or of no simulation, tell nothing") {
  Forecast forecast(model());
  const std::vector<float> before = weights(forecast.state());
  for (const float share : before) CHECK(share == doctest::Approx(1.0 / runs));
  Seen without_time(3, 4), of_no_simulation(3, 4), refused(3, 4);
  without_time.result.fit.test_time = std::nanf("");
  of_no_simulation.result.verdict = Verdict::no_simulation_fits;
  refused.result.status = Status::low_coverage;
  for (const Seen* one : {&without_time, &of_no_simulation, &refused}) CHECK(forecast.update(one->result).frames == 0);
  CHECK(weights(forecast.state()) == before);
  CHECK(forecast.state().parameters[0].r2 == 0);
}

// Regression: such tests had the forecast of the mean of all runs until their end.
TEST_CASE("a test whose beginning was not seen is forecast from what was seen") {
  for (const std::uint32_t begin : {2u, 5u, 8u, 10u}) {
    CAPTURE(begin);
    Forecast forecast(model());
    const std::vector<float> truth = bent(1.5);  // run 10
    const double before = mean_distance(truth, final_positions(model(), forecast.state()));
    REQUIRE(before > 1);
    forecast.update(Seen(10, begin).result);
    const TestForecast& now = forecast.state();
    CHECK(mean_distance(truth, final_positions(model(), now)) < 0.3 * before);
    CHECK(now.parameters[0].is_identifiable());
    CHECK(std::abs(double{now.parameters[0].value} - 1.5) <= double{now.parameters[0].bound_90});
    CHECK(sum(now.run_weights) == doctest::Approx(1).epsilon(1e-4));
    for (std::uint32_t step = begin + 1; step < steps; ++step) forecast.update(Seen(10, step).result);
    CHECK(mean_distance(truth, final_positions(model(), now)) < 0.1 * before);
  }
}

// Regression: a frame just after the impact counted as the first tenth, of which it shows nothing.
TEST_CASE("a frame of the impact and one of the middle are not a beginning that was seen") {
  Forecast late(model()), both(model());
  Seen impact(3, 0);
  impact.result.fit.test_time = 1e-5f;
  both.update(impact.result);
  for (Forecast* forecast : {&late, &both}) forecast->update(Seen(6, 5).result);
  CHECK(weights(late.state()) == weights(both.state()));
  CHECK(late.state().error_90 == both.state().error_90);
}

TEST_CASE("a test of which most frames have a hidden part has the bounds of such tests") {
  const DepthImages& images = *model().view().depth_images;
  REQUIRE(images.hidden_error_bound.per_spread_at(1) > 0);
  REQUIRE(images.hidden_error_bound.per_spread_at(1) != images.error_bound.per_spread_at(1));
  const auto seen_by = [&](const ErrorBound& bound, std::uint32_t step) {
    Seen frame(6, step);
    frame.result.fit.spread = 1;
    frame.result.fit.error_90 = static_cast<float>(bound.per_spread_at(1));
    return frame;
  };
  const auto numbers_after = [&](std::uint32_t hidden) {  // of three frames
    Forecast forecast(model());
    for (std::uint32_t step = 1; step <= 3; ++step)
      forecast.update(seen_by(step <= hidden ? images.hidden_error_bound : images.error_bound, step).result);
    return std::array{forecast.state().error_90, forecast.state().parameters[0].bound_90};
  };
  const auto learned = [&](std::size_t kind) {
    const LearnedForecast& all = *model().view().forecast;
    const double* row = &all.numbers[(kind * (1 + ForecastWindow::count) + 1 + ForecastWindow{1, 3}.number()) *
                                     LearnedForecast::numbers_per_window(2)];
    return std::array{static_cast<float>(row[0]), static_cast<float>(row[3])};
  };
  CHECK(learned(0) != learned(1));
  CHECK(numbers_after(0) == learned(0));
  CHECK(numbers_after(1) == learned(0));
  CHECK(numbers_after(2) == learned(1));
  CHECK(numbers_after(3) == learned(1));
  Forecast mostly_hidden(model());  // the frames have no bound of their error
  for (std::uint32_t step = 1; step <= 3; ++step) mostly_hidden.update(seen_by({std::nan("")}, step).result);
  CHECK(mostly_hidden.state().error_90 == learned(1)[0]);
}

TEST_CASE("after a reset, another test starts from nothing") {
  Forecast forecast(model());
  const std::vector<float> before = weights(forecast.state());
  for (std::uint32_t step = 1; step < 6; ++step) forecast.update(Seen(11, step).result);
  CHECK(weights(forecast.state()) != before);
  forecast.reset();
  CHECK(weights(forecast.state()) == before);
  CHECK(forecast.state().frames == 0);
}

// The server forecasts from the outcome, which it keeps, the replay from the match.
TEST_CASE("results contain the forecast of their test, the same from a match and from what an outcome keeps of it") {
  tool::ModelEngine live(model(), fit_config(), {}, {.knows_impact = true});
  tool::ModelEngine replayed(model(), fit_config(), {}, {.knows_impact = true});
  for (int step = 0; step <= 5; ++step) {
    const std::vector<Point> cloud = seen(bent(0.125 * step));
    const Frame frame{static_cast<std::uint64_t>(step), step * 500'000, cloud};
    tool::Outcome one, other;
    tool::fill_outcome(one, live.match(frame, 0));
    tool::fill_test(one, live, tool::match_of(one));
    const MatchResult match = replayed.match(frame, 0);
    tool::fill_outcome(other, match);
    tool::fill_test(other, replayed, match);
    const wire::WireForecast &a = one.result.forecast, &b = other.result.forecast;
    CHECK(a.frames == b.frames);
    CHECK(a.error_90 == b.error_90);
    REQUIRE(a.runs.size() == b.runs.size());
    for (std::size_t i = 0; i < a.runs.size(); ++i) CHECK(a.runs[i].weight == b.runs[i].weight);
    wire::WireResult result;
    tool::compose(one, live, result);
    REQUIRE(result.channels.size() == 2);
    const ChannelValue displacement = match.channels[0], speed = match.channels[1];
    CHECK(result.channels[0].value == displacement.value);
    CHECK((result.channels[1].value == speed.value) == (a.frames == 0));
    CHECK(std::isnan(result.channels[0].end.value) == (a.frames == 0));
    if (step < 5) continue;
    CHECK(a.frames >= 4);
    CHECK(result.channels[0].end.bound_90 > 0);
    CHECK(a.parameters.size() == 2);
    float all = 0;
    for (const wire::RunWeight& run : a.runs) all += run.weight;
    CHECK(all == doctest::Approx(1).epsilon(1e-4));
    live.begin_test();
    CHECK(live.forecast({})->frames == 0);
  }
}

TEST_CASE("a model without forecasts has none, and says how to get them") {
  const AlignedBytes bytes = bent_plates_model();
  const Model without = Model::view(bytes.span());
  CHECK_FALSE(Forecast::is_in(without));
  check_error(error_of([&] { const Forecast forecast(without); }), Status::bad_config, {"forecast", "bake", "views"});
  CHECK(Forecast::is_in(model()));
}

TEST_CASE("forecasts whose numbers cannot be are refused") {
  const AlignedBytes bytes = plates();
  const auto status_with = [&](SectionId id, std::size_t index, auto value) {
    AlignedBytes forged = bytes;
    forge(forged.span(), id, [&](format::SectionEntry&, std::span<std::byte> section) { set(section, index, value); });
    return status_of(forged.span());
  };
  REQUIRE(status_with(SectionId::window_numbers, 0, 1.0) == Status::ok);
  for (const SectionId id : {SectionId::window_means, SectionId::window_components, SectionId::window_variances,
                             SectionId::window_runs, SectionId::window_parameters})
    for (const float value : {std::numeric_limits<float>::infinity(), std::nanf(""), 1e13f})
      CHECK(status_with(id, 3, value) == Status::corrupt_model);
  for (const std::size_t word : {0u, 1u, 2u, 7u})
    for (const double value : {std::nan(""), 1e300})
      CHECK(status_with(SectionId::window_numbers, word, value) == Status::corrupt_model);
  for (const std::size_t word : {0u, 1u, 3u, 4u, 11u})
    CHECK(status_with(SectionId::window_numbers, word, -1.0) == Status::corrupt_model);
  CHECK(status_with(SectionId::window_numbers, 2, -1.0) == Status::ok);  // R^2
  CHECK(status_with(SectionId::window_numbers, 2, 1.5) == Status::corrupt_model);
  CHECK(status_with(SectionId::window_variances, 3, -1.0f) == Status::corrupt_model);
  for (const float value : {std::numeric_limits<float>::infinity(), std::nanf(""), 1e13f})
    CHECK(status_with(SectionId::channel_products, 3, value) == Status::corrupt_model);
  for (const double value : {std::nan(""), 1e300, -1.0})
    CHECK(status_with(SectionId::channel_numbers, 1, value) == Status::corrupt_model);
  REQUIRE(status_with(SectionId::channel_numbers, 0, 1.0) == Status::ok);
  AlignedBytes longer = bytes;
  forge(longer.span(), SectionId::window_runs, [](format::SectionEntry& entry, auto) { entry.shape[1] += 1; });
  CHECK(status_of(longer.span()) == Status::corrupt_model);
}
