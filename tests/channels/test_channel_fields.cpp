// Channels that are statistics of a field: against the field itself, and what is refused.
#include "precompute/jobs/jobs.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "tests/precompute/baked.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <functional>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;
using format::SectionId;

namespace {

ChannelDescription statistic(ChannelKind kind, std::vector<std::uint32_t> parts = {},
                             std::vector<std::uint32_t> elements = {}) {
  ChannelDescription channel;
  channel.name = std::string(to_string(kind)) + " strain";
  channel.kind = kind;
  channel.field = "plastic_strain";
  channel.parts = std::move(parts);
  channel.elements = std::move(elements);
  return channel;
}

EnsembleDescription with_statistics(std::vector<ChannelDescription> channels) {
  EnsembleDescription description = bent_plates_description();
  description.channels = std::move(channels);
  return description;
}

/// bent_plates() whose second column of nodes is 5 mm farther from the clamped end: elements 501 and 502 are 15 and
/// 5 mm wide. value: of element 502 in state 3 of the last run, unless it is 0.
Ensemble uneven_plates(float value = 0) {
  Ensemble ensemble = bent_plates();
  for (std::uint32_t run = 0; run < ensemble.runs.size(); ++run)
    ensemble.runs[run].open = [run, value, is_last = run + 1 == ensemble.runs.size()] {
      const PlateShape shape;
      SimulationMesh mesh = plate_mesh(shape);
      for (std::size_t node = 1; node < mesh.nodes(); node += shape.columns) mesh.positions[3 * node] += 5;
      std::vector<SimulationState> states;
      for (std::uint32_t step = 0; step < 6; ++step)
        states.push_back(bent_state(mesh, 0.0005 * step, final_angle(run) * step / 5, double{shape.length}));
      if (is_last && value != 0) states[3].fields[0][1] = value;
      return std::make_unique<SyntheticSimulation>(mesh, states, std::vector<SimulationField>{{"plastic_strain", "1"}});
    };
  return ensemble;
}

void check_refused(const ChannelDescription& channel, const char* words) {
  const TemporaryFolder folder;
  CAPTURE(words);
  check_error(error_of([&] { bake_model(bent_plates(), with_statistics({channel}), folder / "m.lbea"); }),
              Status::bad_config, {"channel '" + channel.name + "'", words});
  CHECK(std::filesystem::is_empty(folder.path()));
}

}  // namespace

// The field is angle x / 190 with the x of an element's first node: 10 mm apart from 0 to 180, part 2 from 100 on.
TEST_CASE("statistics of a field are those of its values in the part or the elements") {
  EnsembleDescription description =
      with_statistics({statistic(ChannelKind::maximum), statistic(ChannelKind::minimum, {2}),
                       statistic(ChannelKind::mean, {1}, {519})});
  description.steps.first = 2;
  description.impact_step = 2;
  const Baked baked(bent_plates(), description);
  REQUIRE(baked.model.channels() == 3);
  CHECK(baked.model.channel(0).kind == ChannelKind::maximum);
  CHECK(baked.model.channel(0).unit == "1");
  CHECK(baked.summary.channels[0].field == "plastic_strain");
  CHECK(baked.summary.channels[0].elements.size() == 171);
  CHECK(baked.summary.channels[1].elements.size() == 81);
  CHECK(baked.summary.channels[2].elements.size() == 91);
  std::vector<float> field(baked.model.field_size(0));
  for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
    const auto [run, step] = baked.model.sample(s);
    const double per_mm = final_angle(run) * step / 5 / 190;
    baked.model.read_field(0, s, field);
    CHECK(baked.model.channel_value(0, s) == std::ranges::max(field));
    CHECK(double{baked.model.channel_value(0, s)} == doctest::Approx(180 * per_mm).epsilon(1e-6));
    CHECK(double{baked.model.channel_value(1, s)} == doctest::Approx(100 * per_mm).epsilon(1e-6));
    // 90 elements at 45 mm in the mean, and element 519 at 180 mm.
    CHECK(double{baked.model.channel_value(2, s)} == doctest::Approx((90 * 45 + 180) / 91.0 * per_mm).epsilon(1e-4));
  }
}

TEST_CASE("a mean is weighted by the elements' areas at impact") {
  const Baked baked(uneven_plates(), with_statistics({statistic(ChannelKind::mean, {}, {502, 501})}));
  for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
    const auto [run, step] = baked.model.sample(s);
    // 15 mm of the value at 0 mm, and 5 mm of that at 15 mm.
    CHECK(double{baked.model.channel_value(0, s)} ==
          doctest::Approx(final_angle(run) * step / 5 * 15 / 190 * 5 / 20).epsilon(1e-5));
  }
}

TEST_CASE("statistics of a field: what cannot be is refused") {
  const auto changed = [](const std::function<void(ChannelDescription&)>& change) {
    ChannelDescription channel = statistic(ChannelKind::maximum);
    change(channel);
    return channel;
  };
  check_refused(changed([](auto& c) { c.field = ""; }), "needs a field");
  check_refused(changed([](auto& c) { c.field = "stress"; }),
                "names field 'stress', which the model does not store; it stores plastic_strain");
  check_refused(changed([](auto& c) { c.parts = {1, 3}; }), "names part 3");
  check_refused(changed([](auto& c) { c.elements = {501, 77}; }), "names element 77");
  check_refused(changed([](auto& c) { c.component = ChannelComponent::x; }), "is a maximum, which has no components");
  check_refused(changed([](auto& c) { c.cfc = 60; }), "remove cfc");
  check_refused(changed([](auto& c) { c.points = {ChannelPoint{true, 1001, {}}}; }), "needs 0 points, not 1");
  const auto of_node = [](ChannelDescription& c) {
    c.kind = ChannelKind::displacement, c.points = {ChannelPoint{true, 1020, {}}};
  };
  check_refused(changed(of_node), "is not of a field");
}

TEST_CASE("statistics of a field: a value that is not finite is refused, unless it is outside the elements") {
  const TemporaryFolder folder;
  for (const float value : {NAN, INFINITY, 2e12f})
    for (const auto kind : {ChannelKind::minimum, ChannelKind::maximum, ChannelKind::mean})
      check_error(
          error_of([&] { bake_model(uneven_plates(value), with_statistics({statistic(kind)}), folder / "m.lbea"); }),
          Status::bad_input, {"run plate_3, state 3", "'plastic_strain' of element 502", "not finite or beyond 1e12"});
  const auto others = with_statistics({statistic(ChannelKind::maximum, {2})});
  const Baked whole(uneven_plates(), others), damaged(uneven_plates(NAN), others);
  for (std::uint32_t s = 0; s < whole.model.samples(); ++s)
    CHECK(whole.model.channel_value(0, s) == damaged.model.channel_value(0, s));
}

TEST_CASE("statistics of a field: by fit a frame has the value of its estimate, with a bound") {
  const Baked baked(similar_plates(6, 8), with_statistics({statistic(ChannelKind::maximum)}), with_views());
  Matcher matcher(baked.model, fit_config());
  const MatchResult result = matcher.match({1, 0, seen(bent(0.45))});
  REQUIRE(result.channels.size() == 1);
  CHECK(double{result.channels[0].value} == doctest::Approx(0.45 * 180 / 190).epsilon(0.05));
  CHECK(result.channels[0].bound_90 > 0);
}

TEST_CASE("statistics of a field: any division into shards gives the same bytes") {
  const auto description = with_statistics({statistic(ChannelKind::mean, {1}), statistic(ChannelKind::minimum)});
  const Baked whole(similar_plates(5, 6), description, with_views(1));
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work");
  const BakePlan plan = plan_bake(work, similar_plates(5, 6), description, with_views(2));
  for (std::uint32_t shard = 0; shard < 2; ++shard) (void)bake_shard(work, plan, {shard, 2}, with_views(2));
  merge_shards(work, read_plan(work, [](const std::string&) { return std::unique_ptr<SimulationReader>(); }),
               folder / "m.lbea", with_views(2));
  const AlignedBytes image(folder / "m.lbea");
  CHECK(std::vector<std::byte>(image.span().begin(), image.span().end()) == whole.bytes());
}

TEST_CASE("statistics of a field: damaged rows are refused") {
  const Baked baked(bent_plates(), with_statistics({statistic(ChannelKind::mean)}));
  const AlignedBytes image(baked.folder / "m.lbea");
  REQUIRE(status_of(image.span()) == Status::ok);
  // kind, component, class, nodes, field, elements
  using Change = std::array<std::uint32_t, 2>;  // word, its value
  for (const Change& change : {Change{0, 0}, Change{0, 8}, Change{3, 1}, Change{4, 1}, Change{5, 0}}) {
    AlignedBytes copy = image;
    forge(copy.span(), SectionId::channel_kinds,
          [&](format::SectionEntry&, std::span<std::byte> section) { set(section, change[0], change[1]); });
    CAPTURE(change[0]);
    CHECK(status_of(copy.span()) == Status::corrupt_model);
  }
}
