// Channels that are histories of the solver: their values are the runs' own, and what is refused.
#include "precompute/channels/cfc_filter.hpp"
#include "precompute/jobs/jobs.hpp"
#include "runtime/src/channels/learned_channels.hpp"
#include "tests/channels/written_plates.hpp"
#include "tests/precompute/baked.hpp"
#include "tests/runtime/fit/seen_plates.hpp"
#include "tests/runtime/model/forged_model.hpp"
#include "tests/support/refusals.hpp"

#include <doctest/doctest.h>

#include <functional>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;
using format::SectionId;

namespace {

void check_history_refused(const ChannelDescription& channel, const std::vector<std::string>& words,
                           const Ensemble& ensemble = written_plates()) {
  const TemporaryFolder folder;
  check_error(error_of([&] { bake_model(ensemble, with_histories({channel}), folder / "m.lbea"); }), Status::bad_config,
              words);
  CHECK(std::filesystem::is_empty(folder.path()));
}

}  // namespace

TEST_CASE("histories: every sample has the number of its own run and state") {
  EnsembleDescription description = with_histories(all_kinds());
  description.steps.list = {1, 2, 5};
  description.impact_step = 1;
  const Baked baked(written_plates(), description);
  const std::array<std::uint32_t, 4> places{0, 2, 3, 5};
  const std::array<const char*, 4> texts{"kinetic_energy", "part_mass of part 3", "part_velocity_x of part 7",
                                         "rigid_wall_force of wall 1"};
  REQUIRE(baked.model.channels() == places.size());
  REQUIRE(baked.model.samples() == 12);
  for (std::uint32_t c = 0; c < places.size(); ++c) {
    CHECK(baked.model.channel(c).kind == ChannelKind::history);
    CHECK(baked.model.channel(c).unit == "J");
    CHECK(baked.model.view().channels->history(c).text() == texts[c]);
    CHECK(baked.summary.channels[c].history.text() == texts[c]);
    for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
      const auto [run, step] = baked.model.sample(s);
      CHECK(double{baked.model.channel_value(c, s)} == written(run, step, places[c]));
    }
  }
}

TEST_CASE("histories: with a class they are filtered over all states of the run") {
  EnsembleDescription description = with_histories({energy(150)});
  description.steps.first = 2;
  description.impact_step = 2;
  const Baked baked(written_plates(), description);
  CHECK(baked.model.channel(0).cfc == 150);
  std::vector<double> times, values;
  for (std::uint32_t state = 0; state < 6; ++state) times.push_back(0.0005 * state);
  for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
    const auto [run, step] = baked.model.sample(s);
    values.clear();
    for (std::uint32_t state = 0; state < 6; ++state) values.push_back(written(run, state, 0));
    const double filtered = cfc_filtered_at(times, values, 150)[step];
    CHECK(baked.model.channel_value(0, s) == static_cast<float>(filtered));
    if (step < 5) CHECK(filtered != values[step]);  // the last value stays
  }
}

// Regression: they were filtered as sampled at the states, so that higher frequencies became lower ones.
TEST_CASE("histories: with a class, those that the solver wrote more often are filtered at all their times") {
  HistorySeries series;
  for (int i = 0; i <= 2000; ++i) {  // 5 Hz, and 1980 Hz, which a state every 0.5 ms shows as 20 Hz
    const double time = 0.0025 * i / 2000;
    series.times.push_back(time);
    series.values.push_back(std::sin(2 * M_PI * 5 * time) + std::sin(2 * M_PI * 1980 * time));
  }
  Ensemble ensemble = written_plates();
  for (auto& run : ensemble.runs)
    run.open = [&series] {
      auto plate = std::make_unique<WrittenPlate>(bending_plate(final_angle(1), 6), 1, some_histories());
      plate->set_series(series);
      return plate;
    };
  const Baked baked(ensemble, with_histories({energy(600)}));
  const std::vector<double> smooth = cfc_filtered_at(series.times, series.values, 600);
  for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
    const double time = 0.0005 * baked.model.sample(s).time_step;
    CHECK(baked.model.channel_value(0, s) ==
          doctest::Approx(HistorySeries{series.times, smooth}.at(time)).epsilon(1e-6));
    if (time < 0.0025)  // the last value stays
      CHECK(std::abs(double{baked.model.channel_value(0, s)} - std::sin(2 * M_PI * 5 * time)) < 0.1);
  }
}

// Regression: with a class, values after its end were those at its end.
TEST_CASE("histories: one that the solver wrote for a part of the run alone is refused") {
  const auto written_until = [](double end) {
    HistorySeries series;
    for (int i = 0; i <= 1000; ++i) {
      series.times.push_back(end * i / 1000);
      series.values.push_back(i);
    }
    return series;
  };
  Ensemble ensemble = written_plates();
  for (std::uint32_t run = 0; run < ensemble.runs.size(); ++run)
    ensemble.runs[run].open = [run, series = written_until(run == 1 ? 0.0015 : 0.0025)] {
      auto plate = std::make_unique<WrittenPlate>(bending_plate(final_angle(run), 6), run, some_histories());
      plate->set_series(series);
      return plate;
    };
  for (const std::uint32_t cfc : {0u, 600u}) {
    const TemporaryFolder folder;
    check_error(error_of([&] { bake_model(ensemble, with_histories({energy(cfc)}), folder / "m.lbea"); }),
                Status::bad_input,
                {"run plate_1, state 4: the solver wrote history 'kinetic_energy' from 0.000000 to 0.001500"});
  }
}

TEST_CASE("histories: of a run with another mesh they are its own") {
  Ensemble ensemble = written_plates();
  ensemble.runs[2].open = [] {
    return std::make_unique<WrittenPlate>(bending_plate(final_angle(2), 6, {39, 19}), 2, some_histories());
  };
  const Baked baked(ensemble, with_histories({energy()}));
  REQUIRE(baked.summary.mapped.size() == 1);
  for (std::uint32_t s = 0; s < baked.model.samples(); ++s) {
    const auto [run, step] = baked.model.sample(s);
    CHECK(double{baked.model.channel_value(0, s)} == written(run, step, 0));
  }
}

TEST_CASE("histories: those that a run lacks are refused with what it has") {
  check_history_refused(history({"energy"}), {"run plate_0 has no history 'energy'; it has: kinetic_energy, part_mass, "
                                              "part_velocity_x, rigid_wall_force"});
  check_history_refused(energy(), {"run plate_0 has no history 'kinetic_energy'; it has: none"}, bent_plates());
  check_history_refused(history({"kinetic_energy", HistoryOwner::part, 3}), {"of the whole run; remove part and wall"});
  check_history_refused(history({"part_mass"}), {"'part_mass' is of a part; give its number, as part = 7"});
  check_history_refused(history({"part_mass", HistoryOwner::wall, 1}), {"'part_mass' is of a part"});
  check_history_refused(history({"rigid_wall_force"}), {"as wall = 1"});
  check_history_refused(history({"part_mass", HistoryOwner::part, 2}),
                        {"run plate_0 has no part 2 with history 'part_mass'; it has: 7, 3"});
  Ensemble one_lacks = written_plates();
  one_lacks.runs[2].open = [] {
    return std::make_unique<WrittenPlate>(bending_plate(final_angle(2), 6), 2,
                                          std::vector<SimulationHistory>{{"internal_energy"}});
  };
  check_history_refused(energy(), {"run plate_2 has no history 'kinetic_energy'; it has: internal_energy"}, one_lacks);
  BakeOptions lenient;
  lenient.leaves_out_broken = true;
  const Baked baked(one_lacks, with_histories({energy()}), lenient);
  REQUIRE(baked.summary.left_out.size() == 1);
  CHECK(baked.summary.left_out[0].name == "plate_2");
}

TEST_CASE("histories: descriptions that cannot be are refused") {
  const auto changed = [](const std::function<void(ChannelDescription&)>& change) {
    ChannelDescription channel = energy();
    change(channel);
    return channel;
  };
  check_history_refused(changed([](auto& c) { c.unit = ""; }), {"channel 'the kinetic_energy' needs a unit"});
  check_history_refused(changed([](auto& c) { c.unit = "J\n"; }), {"needs a unit"});
  check_history_refused(changed([](auto& c) { c.component = ChannelComponent::x; }),
                        {"is a history, which has no components"});
  check_history_refused(changed([](auto& c) { c.points = {ChannelPoint{true, 1001, {}}}; }), {"needs 0 points, not 1"});
  check_history_refused(changed([](auto& c) { c.field = "plastic_strain"; }), {"is not of a field"});
  check_history_refused(changed([](auto& c) { c.cfc = 1001; }), {"from 1 to 1000"});
  const auto of_node = [](ChannelDescription& c) {
    c.kind = ChannelKind::displacement, c.points = {ChannelPoint{true, 1020, {}}};
  };
  check_history_refused(changed(of_node), {"is not a history; remove"});
}

TEST_CASE("histories: a number that is not finite is refused, unless its state is not needed") {
  const TemporaryFolder folder;
  for (const double value : {double{NAN}, double{INFINITY}, 2e12}) {
    const auto bake = [&](const EnsembleDescription& description) {
      return error_of([&] { bake_model(written_plates({3, value}), description, folder / "m.lbea"); });
    };
    const std::vector<std::string> words{"run plate_3, state 3: history 'kinetic_energy' is not finite or beyond 1e12",
                                         "channel 'the kinetic_energy' needs it"};
    check_error(bake(with_histories({energy()})), Status::bad_input, words);
    EnsembleDescription others = with_histories({energy(150)});
    others.steps.list = {0, 1, 5};
    check_error(bake(others), Status::bad_input, words);
    others.channels = {energy()};
    const Baked whole(written_plates(), others), damaged(written_plates({3, value}), others);
    for (std::uint32_t s = 0; s < whole.model.samples(); ++s)
      CHECK(whole.model.channel_value(0, s) == damaged.model.channel_value(0, s));
  }
  check_error(error_of([&] { bake_model(written_plates(), with_histories({energy(1000)}), folder / "m.lbea"); }),
              Status::bad_input, {"run plate_", "channel 'the kinetic_energy'", "too rare for class 1000"});
}

TEST_CASE("histories: any division into shards gives the same bytes") {
  const auto description = with_histories(all_kinds());
  const Baked whole(written_plates(), description, with_views(1));
  const TemporaryFolder folder;
  const WorkFolder work(folder / "work");
  const BakePlan plan = plan_bake(work, written_plates(), description, with_views(2));
  for (std::uint32_t shard = 0; shard < 2; ++shard) (void)bake_shard(work, plan, {shard, 2}, with_views(2));
  merge_shards(work, read_plan(work, [](const std::string&) { return std::unique_ptr<SimulationReader>(); }),
               folder / "m.lbea", with_views(2));
  const AlignedBytes image(folder / "m.lbea");
  CHECK(std::vector<std::byte>(image.span().begin(), image.span().end()) == whole.bytes());
}

TEST_CASE("histories: by fit a frame has the value of its estimate, with a bound") {
  Ensemble ensemble = similar_plates(6, 8);
  for (std::uint32_t run = 0; run < 6; ++run)
    ensemble.runs[run].open = [run] {
      return std::make_unique<WrittenPlate>(bending_plate(0.5 + 0.1 * run, 8), run, some_histories());
    };
  const Baked baked(ensemble, with_histories({energy()}), with_views());
  Matcher matcher(baked.model, fit_config());
  const MatchResult result = matcher.match({1, 0, seen(bent(0.45))});
  REQUIRE(result.channels.size() == 1);
  double value = 0;
  for (const WeightedSample& one : result.fit.estimate)
    value += double{one.weight} * written(one.sample.simulation, one.sample.time_step, 0);
  CHECK(double{result.channels[0].value} == doctest::Approx(value).epsilon(1e-5));
  CHECK(result.channels[0].bound_90 > 0);
}

TEST_CASE("histories: damaged sections are refused") {
  const Baked baked(written_plates(), with_histories({energy()}));
  const AlignedBytes image(baked.folder / "m.lbea");
  REQUIRE(status_of(image.span()) == Status::ok);
  // kind, component, class, nodes, owner, its number
  using Change = std::array<std::uint32_t, 2>;  // word, its value
  for (const Change& change : {Change{0, 9}, Change{0, 7}, Change{3, 1}, Change{4, 3}, Change{5, 1}}) {
    AlignedBytes copy = image;
    forge(copy.span(), SectionId::channel_kinds,
          [&](format::SectionEntry&, std::span<std::byte> section) { set(section, change[0], change[1]); });
    CAPTURE(change[0]);
    CHECK(status_of(copy.span()) == Status::corrupt_model);
  }
  AlignedBytes two = image, none = image;
  forge(two.span(), SectionId::channel_histories,
        [](format::SectionEntry&, std::span<std::byte> section) { set(section, 3, '\0'); });
  CHECK(status_of(two.span()) == Status::corrupt_model);
  forge(none.span(), SectionId::channel_histories,
        [](format::SectionEntry& entry, std::span<std::byte>) { entry.id = 0x9000; });
  CHECK(status_of(none.span()) == Status::corrupt_model);
}
