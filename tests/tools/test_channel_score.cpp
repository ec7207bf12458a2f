// The truth of channels that are histories.
#include "tests/channels/written_plates.hpp"
#include "tests/precompute/baked.hpp"
#include "tools/eval/channels/channel_score.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

TEST_CASE("the truth of a history is the test's own run's; of a run that lacks it, none is known") {
  const Baked baked(written_plates(), with_histories({energy()}));
  Matcher matcher(baked.model);
  std::vector<Point> points;
  const auto positions = baked.model.node_positions(9);
  for (std::size_t i = 0; i < positions.size(); i += 3)
    points.push_back({positions[i], positions[i + 1], positions[i + 2]});
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
