// The truth of channels that are histories.
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

}  // namespace

TEST_CASE("the truth of a history is the test's own run's; of a run that lacks it, none is known") {
  const Baked baked(written_plates(), with_histories({energy()}));
  Matcher matcher(baked.model);
  const std::vector<Point> points = nodes_of(baked.model, 9);
  const MatchResult result = matcher.match({1, 0, points});
  SimulationState state;
  const auto judged = [&](SimulationReader& run) {
    const auto read = [&](std::uint32_t at, std::vector<float>& into) {
      run.read(at, state);
      into = state.positions;
    };
    return ChannelJudge(baked.model, run, 1, read, "seven").scores(result, nullptr, 3).at(0);
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
  const auto read = [&](std::uint32_t at, std::vector<float>& into) {
    run.read(at, state);
    into = state.positions;
    hide_free_nodes(run.mesh(), state.alive, into);
  };
  const ChannelJudge judge(baked.model, run, 1, read, "seven");
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
