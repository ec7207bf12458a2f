#include "precompute/survey/survey.hpp"

#include <lbea/lbea.hpp>

#include <doctest/doctest.h>

using namespace lbea;
using namespace lbea::bake;
using Steps = std::vector<std::uint32_t>;

namespace {
constexpr std::uint32_t end = StepSelection{}.last;
}

TEST_CASE("steps: all, a range with stride, a list") {
  CHECK(used_steps({}, 3, "a") == Steps{0, 1, 2});
  CHECK(used_steps({1, 9, 3, {}}, 6, "a") == Steps{1, 4});
  CHECK(used_steps({2, 2, 1, {}}, 6, "a") == Steps{2});
  CHECK(used_steps({0, end, 0xffffffff, {}}, 6, "a") == Steps{0});
  CHECK(used_steps({0, end, 1, {4, 0, 4}}, 5, "a") == Steps{0, 4});
}

TEST_CASE("the error about missing steps names the run") {
  CHECK_THROWS_WITH_AS((void)used_steps({0, end, 1, {1, 5}}, 5, "a"), doctest::Contains("run a has no state 5, only 5"),
                       Error);
  CHECK_THROWS_WITH_AS((void)used_steps({5, end, 1, {}}, 5, "a"),
                       doctest::Contains("no state of run a is used: it has 5"), Error);
  CHECK_THROWS_WITH_AS((void)used_steps({}, 0, "a"), doctest::Contains("it has 0"), Error);
  CHECK_THROWS_WITH_AS((void)used_steps({0, end, 0, {}}, 5, "a"), doctest::Contains("stride"), Error);
}

TEST_CASE("a missing state shifted the later ones without a word: unequal intervals are named") {
  const auto warning = [](const Steps& steps, const std::vector<double>& times) {
    return irregular_times({steps, times, {}, {}}, "a").value_or("");
  };
  CHECK(warning({0, 1, 2, 3, 4}, {0, 1e-3, 2e-3, 3e-3, 4e-3}).empty());
  CHECK(warning({0, 1, 2, 3, 4}, {0, 1.01e-3, 2e-3, 3e-3, 3.2e-3}).empty());  // whole time steps, and the end
  CHECK(warning({0, 4, 6, 8}, {0, 4e-3, 6e-3, 8e-3}).empty());                // chosen states
  CHECK(warning({0, 1, 2, 3, 4}, {0, 1e-3, 3e-3, 4e-3, 5e-3}) ==
        "run a: state 2 comes 0.002 s after the one before it, most others 0.001 s; is a state missing?");
}
