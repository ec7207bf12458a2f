// Depth images of one half of a bending plate beside the other half.
#include "tools/shared/views/assembled_views.hpp"

#include "tests/components/plate_parts.hpp"
#include "tools/shared/views/views.hpp"

#include <doctest/doctest.h>

#include <cmath>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::test;

namespace {

constexpr float middle = 95;

struct Halves {
  Model clamped = part_of_plates({0, -INFINITY, middle}), free = part_of_plates({0, middle, INFINITY}, true);
  SensorViews alone = tool::rendered(clamped, rig_above()),
              beside = tool::assembled_views(clamped, {free}, rig_above());
};

/// What the rig sees of the whole plate in the state of a sample.
std::vector<Point> seen_whole(const Model& model, std::uint32_t s) {
  const Sample sample = model.sample(s);
  const auto run = similar_plates(4, 6).runs[sample.simulation].open();
  SimulationState state;
  run->read(sample.time_step, state);
  return seen(state.positions);
}

}  // namespace

TEST_CASE("beside the other half, an image has all of its own cells, and the neighbour's near it, of the same run") {
  const Halves halves;
  REQUIRE(halves.alone.columns() == halves.beside.columns());
  std::size_t more = 0;  // cells of the neighbour
  for (std::uint32_t s = 0; s < halves.clamped.samples(); ++s) {
    const auto alone = halves.alone.depth_image(s), beside = halves.beside.depth_image(s);
    std::size_t own = 0, kept = 0;
    for (std::size_t cell = 0; cell < alone.size(); ++cell) {
      own += std::isnan(alone[cell]) ? 0u : 1u;
      kept += !std::isnan(alone[cell]) && std::abs(alone[cell] - beside[cell]) < 1 ? 1u : 0u;
      more += std::isnan(alone[cell]) && !std::isnan(beside[cell]) ? 1u : 0u;
    }
    CHECK(own > 100);
    CHECK(static_cast<double>(kept) > 0.95 * static_cast<double>(own));  // but for cells that both halves share
  }
  CHECK(more > halves.clamped.samples());
}

TEST_CASE("frames of the whole plate are explained by the half beside the other one, and not by the half alone") {
  const Halves halves;
  Matcher alone(halves.clamped, fit_config(), halves.alone), beside(halves.clamped, fit_config(), halves.beside);
  int right_alone = 0, right_beside = 0, frames = 0;
  float residuals_alone = 0, residuals_beside = 0;
  for (std::uint32_t s = 0; s < halves.clamped.samples(); ++s) {
    if (halves.clamped.sample(s).time_step == 0) continue;  // all runs begin with the same shape
    const std::vector<Point> points = seen_whole(halves.clamped, s);
    const MatchResult by_half = alone.match({s, 0, points});
    const float residual_alone = by_half.fit.residual;
    residuals_alone += residual_alone;
    right_alone += by_half.matches.front().sample == halves.clamped.sample(s) ? 1 : 0;
    const MatchResult by_both = beside.match({s, 0, points});
    REQUIRE_FALSE(by_both.matches.empty());
    CHECK(by_both.fit.residual < residual_alone);
    residuals_beside += by_both.fit.residual;
    right_beside += by_both.matches.front().sample == halves.clamped.sample(s) ? 1 : 0;
    ++frames;
  }
  CHECK(right_alone <= right_beside);  // the correction by the points finds the sample in spite of the other half
  CHECK(residuals_alone > 5 * residuals_beside);
  CHECK(right_beside >= frames - 1);  // the least bent plates are less than the noise of the images apart
}

TEST_CASE("components far from each other are as alone") {
  const Model end = part_of_plates({0, 150, INFINITY});
  const Model start = part_of_plates({0, -INFINITY, 40});
  const SensorViews alone = tool::rendered(start, rig_above()),
                    beside = tool::assembled_views(start, {end}, rig_above());
  for (std::uint32_t s = 0; s < start.samples(); ++s) {
    const auto a = alone.depth_image(s), b = beside.depth_image(s);
    CHECK(std::ranges::equal(a, b, [](float x, float y) { return x == y || (std::isnan(x) && std::isnan(y)); }));
  }
}
