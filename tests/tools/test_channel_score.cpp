// The truth of channels.
#include "tests/channels/written_plates.hpp"
#include "tests/precompute/baked.hpp"
#include "tests/support/eroding_plates.hpp"
#include "tools/eval/channels/channel_score.hpp"
#include "tools/eval/truth.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

std::vector<Point> nodes_of(const Model& model, std::uint32_t sample) {
  const auto positions = model.node_positions(sample);
  std::vector<Point> points;
  for (std::size_t i = 0; i < positions.size(); i += 3)
    points.push_back({positions[i], positions[i + 1], positions[i + 2]});
  return points;
}

/// What a judge reads of a run, as the evaluation does. The run outlives the reader.
ChannelJudge::ReadState reader_of(SimulationReader& run, const Model& model) {
  return [&run, &model, mesh = TrueMesh(run.mesh(), model, {})](std::uint32_t at) {
    SimulationState state;
    run.read(at, state);
    ChannelJudge::TrueState truth{{}, true_fields(mesh, run, state, model)};
    hide_free_nodes(run.mesh(), state.alive, state.positions);
    mesh.positions(state.positions, truth.positions);
    return truth;
  };
}

ChannelDescription strain(ChannelKind kind, std::vector<std::uint32_t> parts = {}) {
  ChannelDescription channel;
  channel.name = std::string(to_string(kind)) + " of strain";
  channel.kind = kind;
  channel.field = "plastic_strain";
  channel.parts = std::move(parts);
  return channel;
}

EnsembleDescription with_strains() {
  EnsembleDescription description = bent_plates_description();
  description.channels = {strain(ChannelKind::maximum), strain(ChannelKind::minimum, {2}), strain(ChannelKind::mean)};
  return description;
}

}  // namespace

TEST_CASE("the truth of a statistic of a field is what a bake computes from the same run, also where elements erode") {
  const Ensemble runs = eroding_plates(3, 6, 4);
  const Baked baked(runs, with_strains());
  Matcher matcher(baked.model);
  const std::vector<Point> points = nodes_of(baked.model, 9);
  const MatchResult result = matcher.match({1, 0, points});
  REQUIRE(result.channels.size() == 3);
  for (std::uint32_t number = 0; number < runs.runs.size(); ++number) {
    const auto run = runs.runs[number].open();
    const ChannelJudge judge(baked.model, baked.summary.channels, *run, 1, reader_of(*run, baked.model), "own");
    for (std::uint32_t state = 0; state < 6; ++state)
      for (std::uint32_t c = 0; c < 3; ++c) {
        const ChannelScore score = judge.scores(result, nullptr, state).at(c);
        CHECK(score.truth == double{baked.model.channel_value(c, baked.model.sample_index({number, state}))});
        CHECK(score.final_truth == double{baked.model.channel_value(c, baked.model.sample_index({number, 5}))});
      }
  }
}

TEST_CASE("the truth of a statistic of a field is not known of another mesh, without the field, of eroded elements") {
  const Baked baked(bent_plates(), with_strains());
  Matcher matcher(baked.model);
  const std::vector<Point> points = nodes_of(baked.model, 9);
  const MatchResult result = matcher.match({1, 0, points});
  const auto truth_of = [&](SyntheticSimulation run, std::size_t channel) {
    const auto read = reader_of(run, baked.model);
    return ChannelJudge(baked.model, baked.summary.channels, run, 1, read, "own")
        .scores(result, nullptr, 3)
        .at(channel)
        .truth;
  };
  const SyntheticSimulation whole = bending_plate(0.7, 6);
  PlateShape finer;
  finer.columns = 2 * finer.columns - 1;
  std::vector<SimulationState> without, eroded;
  for (std::uint32_t step = 0; step < 6; ++step) {
    SyntheticSimulation plate = whole;
    plate.read(step, without.emplace_back());
    eroded.push_back(without.back());
    without.back().fields.clear();
    for (std::size_t e = 0; e < eroded.back().alive.size(); ++e)
      if (whole.mesh().element_parts[e] == 2) eroded.back().alive[e] = 0;
  }
  for (std::size_t channel = 0; channel < 3; ++channel) {
    CHECK(std::isfinite(truth_of(whole, channel)));
    CHECK(std::isnan(truth_of(bending_plate(0.7, 6, finer), channel)));
    CHECK(std::isnan(truth_of({whole.mesh(), without, {}}, channel)));
    CHECK(std::isnan(truth_of({whole.mesh(), eroded, whole.fields()}, channel)) == (channel == 1));
  }
}

TEST_CASE("the truth of a history is the test's own run's; of a run that lacks it, none is known") {
  const Baked baked(written_plates(), with_histories({energy()}));
  Matcher matcher(baked.model);
  const std::vector<Point> points = nodes_of(baked.model, 9);
  const MatchResult result = matcher.match({1, 0, points});
  const auto judged = [&](SimulationReader& run) {
    return ChannelJudge(baked.model, baked.summary.channels, run, 1, reader_of(run, baked.model), "seven")
        .scores(result, nullptr, 3)
        .at(0);
  };
  WrittenPlate run(bending_plate(0.7, 6), 7, some_histories());
  const ChannelScore score = judged(run);
  CHECK(score.truth == written(7, 3, 0));
  CHECK(score.final_truth == written(7, 5, 0));
  CHECK(static_cast<float>(score.value) == result.channels[0].value);
  WrittenPlate without(bending_plate(0.7, 6), 7, {{"internal_energy"}});
  CHECK(std::isnan(judged(without).truth));
}

TEST_CASE(
    "the truth of a channel ends where its node is free: the flight of the node is no quantity of the component") {
  ChannelDescription channel{"moved", ChannelKind::displacement, ChannelComponent::z, 0, {}, {}};
  const std::size_t node = patch_nodes()[4];
  channel.points = {{true, plate_mesh().node_ids[node], {}}};
  EnsembleDescription description = bent_plates_description();
  description.channels = {channel};
  const Baked baked(bent_plates(), description);
  Matcher matcher(baked.model);
  const std::vector<Point> points = nodes_of(baked.model, 9);
  const MatchResult result = matcher.match({1, 0, points});
  SyntheticSimulation run = eroding_plate(0.7, 6, 4), whole = bending_plate(0.7, 6);
  SimulationState state;
  const ChannelJudge judge(baked.model, baked.summary.channels, run, 1, reader_of(run, baked.model), "seven");
  const auto height = [&](std::uint32_t at) {
    whole.read(at, state);
    return state.positions[3 * node + 2];
  };
  for (std::uint32_t at = 0; at < 6; ++at) {
    const ChannelScore score = judge.scores(result, nullptr, at).at(0);
    if (at < 4)
      CHECK(score.truth == doctest::Approx(double{height(at)} - double{height(0)}));
    else
      CHECK(std::isnan(score.truth));
    CHECK(std::isnan(score.final_truth));
  }
}
