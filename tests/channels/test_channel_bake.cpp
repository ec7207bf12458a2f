// Channels of baked models: what the description may say, what the model holds, and what the matcher gives.
#include "precompute/jobs/jobs.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "runtime/src/model/model_view.hpp"
#include "tests/precompute/baked.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;
using format::SectionId;

namespace {

constexpr std::uint32_t free_end = 1020;  // at x = 190, y = 0

ChannelPoint node(std::uint32_t id) { return {true, id, {}}; }
ChannelPoint place(double x, double y, double z) { return {false, 0, {x, y, z}}; }

std::vector<ChannelDescription> some_channels() {
  return {{"end x", ChannelKind::displacement, ChannelComponent::x, 0, {node(free_end)}, {}},
          {"end speed", ChannelKind::velocity, ChannelComponent::z, 150, {node(free_end)}, {}},
          {"across", ChannelKind::distance, ChannelComponent::resultant, 0, {node(1001), node(free_end)}, {}},
          {"bulge",
           ChannelKind::intrusion,
           ChannelComponent::z,
           0,
           {node(free_end), node(1001), node(1002), node(1021)},
           {}}};
}

EnsembleDescription with_channels(std::vector<ChannelDescription> channels = some_channels()) {
  EnsembleDescription description = bent_plates_description();
  description.channels = std::move(channels);
  return description;
}

void check_refused(const std::function<void(ChannelDescription&)>& change, const char* words) {
  const TemporaryFolder folder;
  std::vector<ChannelDescription> channels = some_channels();
  change(channels.front());
  CAPTURE(words);
  check_error(error_of([&] { bake_model(bent_plates(), with_channels(channels), folder / "m.lbea"); }),
              Status::bad_config, {words});
  CHECK(std::filesystem::is_empty(folder.path()));
}

double end_x(double angle) { return angle == 0 ? 0 : 190 * std::sin(angle) / angle - 190; }

}  // namespace

TEST_CASE("channels: a displacement counts from the run's first state, not from the first used one") {
  EnsembleDescription description = with_channels();
  description.steps.first = 2;
  description.impact_step = 2;
  const Baked baked(bent_plates(), description);
  REQUIRE(baked.model.channels() == 4);
  CHECK(baked.model.channel(0).name == "end x");
  CHECK(baked.model.channel(1).unit == "mm/s");
  CHECK(baked.model.channel(1).cfc == 150);
  CHECK(baked.model.channel(3).kind == ChannelKind::intrusion);
  for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
    const auto [run, step] = baked.model.sample(s);
    const double angle = final_angle(run) * step / 5;
    CHECK(double{baked.model.channel_value(0, s)} == doctest::Approx(end_x(angle)).epsilon(1e-4));
    // The chord of an arc, and its height above the tangent at the clamped end.
    CHECK(double{baked.model.channel_value(2, s)} ==
          doctest::Approx(2 * 190 / angle * std::sin(angle / 2)).epsilon(1e-4));
  }
}

TEST_CASE("channels: a place takes the nearest vertex, and tells how far it is") {
  std::vector<ChannelDescription> channels = some_channels();
  channels[0].points = {place(188, 1, 2)};
  const Baked baked(bent_plates(), with_channels(channels));
  REQUIRE(baked.summary.channels.size() == 4);
  CHECK(baked.summary.channels[0].node_ids == std::vector<std::uint32_t>{free_end});
  CHECK(baked.summary.channels[0].distances[0] == doctest::Approx(3));
  CHECK(baked.summary.channels[1].distances[0] == 0);
}

TEST_CASE("channels: points and names that are wrong are refused") {
  check_refused([](auto& c) { c.name = ""; }, "channel 1 has no name");
  check_refused([](auto& c) { c.name = "end\x1b[2J"; }, "has control characters");
  check_refused([](auto& c) { c.name = "across"; }, "two channels are called 'across'");
  check_refused([](auto& c) { c.points = {node(77)}; }, "names node 77, which the reference run does not have");
  check_refused([](auto& c) { c.points = {place(250, 0, 0)}; }, "60 mm from the nearest vertex");
  // The edges at a corner are 10 mm long.
  check_refused([](auto& c) { c.points = {place(200.1, 0, 0)}; }, "more than 10 mm are refused");
  check_refused([](auto& c) { c.points = {place(188, 0, 0)}, c.reach = 1; }, "more than 1 mm are refused");
  check_refused([](auto& c) { c.points.clear(); }, "needs 1 point, not 0");
  check_refused([](auto& c) { c.cfc = 60; }, "is not filtered; remove cfc");
  check_refused([](auto& c) { c.kind = ChannelKind::velocity; }, "needs the class of its filter");
  check_refused(
      [](auto& c) {
        c.kind = ChannelKind::distance, c.points = {node(1001), node(1002)};
      },
      "is a distance, which has no components");
  check_refused(
      [](auto& c) {
        c.kind = ChannelKind::distance, c.component = ChannelComponent::resultant, c.points = {node(1001), node(1001)};
      },
      "has two points at the same node");
}

TEST_CASE("channels: a class above the states' rate, and states without a position, are refused") {
  const TemporaryFolder folder;
  std::vector<ChannelDescription> channels = some_channels();
  channels[1].cfc = 600;
  check_error(error_of([&] { bake_model(bent_plates(), with_channels(channels), folder / "m.lbea"); }),
              Status::bad_input, {"run plate_0, channel 'end speed'", "too rare for class 600", "at most cfc = 200"});
  Ensemble ensemble = bent_plates();
  ensemble.runs[2].open = [] {
    SyntheticSimulation plate = bending_plate(0.8, 6);
    std::vector<SimulationState> states(6);
    for (std::uint32_t i = 0; i < 6; ++i) plate.read(i, states[i]);
    states[1].positions[3 * (free_end - 1001)] = NAN;
    return std::make_unique<SyntheticSimulation>(plate.mesh(), states, plate.fields());
  };
  EnsembleDescription description = with_channels();
  description.steps.first = 2;  // the state is not used
  description.impact_step = 2;
  check_error(error_of([&] { bake_model(ensemble, description, folder / "m.lbea"); }), Status::bad_input,
              {"run plate_2, state 1", "node 1020", "channel 'end x' needs it"});
}

TEST_CASE("channels: by lbea a frame has the values of its best sample, without bounds") {
  const Baked baked(bent_plates(), with_channels());
  Matcher matcher(baked.model);
  const auto positions = baked.model.node_positions(9);
  std::vector<Point> points;
  for (std::size_t i = 0; i < positions.size(); i += 3)
    points.push_back({positions[i], positions[i + 1], positions[i + 2]});
  const MatchResult result = matcher.match({1, 0, points});
  REQUIRE(result.channels.size() == 4);
  const std::uint32_t sample = baked.model.sample_index(result.matches.front().sample);
  for (std::uint32_t c = 0; c < 4; ++c) {
    CHECK(result.channels[c].value == baked.model.channel_value(c, sample));
    CHECK(std::isnan(result.channels[c].bound_90));
  }
  CHECK(matcher.match({2, 0, {}}).channels.empty());
}

TEST_CASE("channels: by fit a frame has the values of its estimate, with bounds") {
  const Baked baked(similar_plates(6, 8), with_channels(), with_views());
  Matcher matcher(baked.model, fit_config());
  const MatchResult result = matcher.match({1, 0, seen(bent(0.45))});
  REQUIRE(result.channels.size() == 4);
  double value = 0;
  for (const WeightedSample& one : result.fit.estimate)
    value += double{one.weight} * double{baked.model.channel_value(0, baked.model.sample_index(one.sample))};
  CHECK(double{result.channels[0].value} == doctest::Approx(value).epsilon(1e-5));
  CHECK(std::abs(value - end_x(0.45)) < 1);
  CHECK(result.channels[0].bound_90 > 0);
}

// The bounds are learned from frames that simulations explain.
TEST_CASE("channels: a frame that no simulation explains has no bounds") {
  const Baked baked(similar_plates(6, 8), with_channels(), with_views());
  Matcher matcher(baked.model, fit_config());
  std::vector<Point> points = seen(bent(0.45));
  for (Point& point : points) point.z += 20 * std::sin(point.x / 10);
  const MatchResult result = matcher.match({1, 0, points});
  REQUIRE(result.verdict == Verdict::no_simulation_fits);
  REQUIRE(result.channels.size() == 4);
  CHECK(std::isnan(result.channels[0].bound_90));
  CHECK(std::isfinite(result.channels[0].value));
}

TEST_CASE("channels: any division into shards gives the same bytes") {
  const Baked whole(similar_plates(5, 6), with_channels(), with_views(1));
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work");
  const BakePlan plan = plan_bake(work, similar_plates(5, 6), with_channels(), with_views(2));
  for (std::uint32_t shard = 0; shard < 2; ++shard) (void)bake_shard(work, plan, {shard, 2}, with_views(2));
  merge_shards(work, read_plan(work, [](const std::string&) { return std::unique_ptr<SimulationReader>(); }),
               folder / "m.lbea", with_views(2));
  const AlignedBytes image(folder / "m.lbea");
  CHECK(std::vector<std::byte>(image.span().begin(), image.span().end()) == whole.bytes());
}

TEST_CASE("channels: damaged sections are refused") {
  const Baked baked(similar_plates(3, 4), with_channels({some_channels()[0]}), with_views());
  const AlignedBytes image(baked.folder / "m.lbea");
  REQUIRE(status_of(image.span()) == Status::ok);
  const auto status_with = [&](SectionId id, std::size_t index, auto value) {
    AlignedBytes copy = image;
    forge(copy.span(), id, [&](format::SectionEntry&, std::span<std::byte> section) { set(section, index, value); });
    return status_of(copy.span());
  };
  CHECK(status_with(SectionId::channel_kinds, 0, 8u) == Status::corrupt_model);
  CHECK(status_with(SectionId::channel_kinds, 1, 4u) == Status::corrupt_model);
  for (const std::uint32_t nodes : {0u, 5u})
    CHECK(status_with(SectionId::channel_kinds, 3, nodes) == Status::corrupt_model);
  CHECK(status_with(SectionId::channel_values, 1, NAN) == Status::corrupt_model);
  CHECK(status_with(SectionId::channel_values, 1, 2e12f) == Status::corrupt_model);
  for (const double bound : {-1.0, double{NAN}, 1e13})
    CHECK(status_with(SectionId::channel_bounds, 2, bound) == Status::corrupt_model);
  CHECK(status_with(SectionId::channel_names, 5, 'x') == Status::corrupt_model);  // one string, and no unit
  AlignedBytes shorter = image;
  forge(shorter.span(), SectionId::channel_values,
        [](format::SectionEntry& entry, std::span<std::byte>) { entry.id = 0x9000; });
  CHECK(status_of(shorter.span()) != Status::ok);
}
