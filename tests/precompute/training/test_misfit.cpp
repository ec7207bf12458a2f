#include "precompute/depth_images/residuals.hpp"
#include "precompute/left_out/branches.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

using namespace lbea;
using namespace lbea::bake;

TEST_CASE("the expected residual is the median of its time step, robust against a few outliers") {
  std::vector<LeftOut> answers;
  for (std::uint32_t simulation = 0; simulation < 11; ++simulation)
    for (std::uint32_t step = 0; step < 6; ++step) {
      const float usual = static_cast<float>(step + 1) + 0.01f * static_cast<float>(simulation);
      answers.push_back({{simulation, step}, simulation < 2 ? 1e4f : usual * usual});
    }
  const ExpectedResiduals expected(answers);
  for (std::uint32_t step = 0; step < 6; ++step) CHECK(expected.at(step) == doctest::Approx(step + 1).epsilon(0.11));
  CHECK(expected.at(100) == expected.at(5));
}

// A table for every step up to the last one took minutes to make, and without end for this one.
TEST_CASE("time steps may be far apart") {
  constexpr std::uint32_t last = 0xffff'ffff;
  std::vector<LeftOut> answers;
  for (const std::uint32_t step : {0u, 3u, last})
    for (std::uint32_t simulation = 0; simulation < 5; ++simulation) answers.push_back({{simulation, step}, 4});
  answers.push_back({{5, last}, 9});
  answers.push_back({{6, last}, 9});
  const ExpectedResiduals expected(answers);
  for (const std::uint32_t step : {0u, 1u, 1'000u, last - 1, last}) CHECK(expected.at(step) == 2);
}

TEST_CASE("the limit is exceeded by one in a thousand log-normal misfits") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<LeftOut> answers;
  constexpr double sigma = 0.2, usual = 30;  // far above the noise
  for (std::uint32_t simulation = 0; simulation < 200; ++simulation)
    for (std::uint32_t step = 0; step < 20; ++step)
      answers.push_back({{simulation, step}, static_cast<float>(usual * usual * std::exp(2 * sigma * normal(random)))});
  const MisfitLimits limits = misfit_limits(answers, ExpectedResiduals(answers));
  CHECK(std::log(static_cast<double>(limits.frame)) == doctest::Approx(3 * sigma).epsilon(0.1));
  CHECK(limits.test < limits.frame);  // means scatter less
}

// With the first frame's full weight, 90 times that of a later one, the limit of the tests would be exp(1.2).
TEST_CASE("the limit of tests lets no single frame decide") {
  std::mt19937 random(5);
  std::normal_distribution<double> normal;
  std::vector<LeftOut> answers;
  constexpr double sigma = 0.4, first = 3, later = 30;  // expected residuals, mm; the mesh noise is 1 mm
  for (std::uint32_t simulation = 0; simulation < 200; ++simulation)
    for (std::uint32_t step = 0; step < 10; ++step) {
      const double squared = step > 0 ? later * later : (first * first + 1) * std::exp(2 * sigma * normal(random)) - 1;
      answers.push_back({{simulation, step}, static_cast<float>(std::max(squared, 0.0))});
    }
  // The first frame weighs as much as (30^2 + 1) / (7.5^2 + 1) = 15.7 later ones: 84 % of a mean over 4 frames, 64 % of
  // one over 10.
  const double limit = std::log(static_cast<double>(misfit_limits(answers, ExpectedResiduals(answers)).test));
  CHECK(limit == doctest::Approx(3.2 * sigma * 0.73).epsilon(0.12));
}

TEST_CASE("with too few samples the limits are the defaults") {
  CHECK(misfit_limits({}, ExpectedResiduals({})).frame == MisfitLimits{}.frame);
  CHECK(ExpectedResiduals({}).at(3) == 0);
}

TEST_CASE("groups of similar shapes are branches, numbered in order of appearance; one group is one branch") {
  const auto shape = [](float x) { return std::vector<float>{x, 0, 0, 0, x, 0}; };
  const std::vector<std::vector<float>> two{shape(100), shape(0), shape(1), shape(101), shape(2)};
  CHECK(deformation_branches(two) == std::vector<std::uint32_t>{0, 1, 1, 0, 1});
  const std::vector<std::vector<float>> one{shape(0), shape(1), shape(2), shape(3)};
  CHECK(deformation_branches(one) == std::vector<std::uint32_t>{0, 0, 0, 0});
  CHECK(deformation_branches({}).empty());
  CHECK(deformation_branches(std::vector<std::vector<float>>{shape(3)}) == std::vector<std::uint32_t>{0});
  const std::vector<std::vector<float>> same(3, shape(7));
  CHECK(deformation_branches(same) == std::vector<std::uint32_t>{0, 0, 0});
}
