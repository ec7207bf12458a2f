#include "runtime/src/fit/surface_fit.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

using namespace lbea;

TEST_CASE("the answer meets the optimality conditions: on the simplex, no share worth moving") {
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  SimplexProblem problem(24);
  for (const std::size_t k : {1u, 2u, 3u, 24u})
    for (int trial = 0; trial < 20; ++trial) {
      const std::size_t rows = k + 3;
      std::vector<float> factors(rows * k), gram(k * k, 0.0f), linear(k);
      for (float& f : factors) f = normal(random);
      for (float& c : linear) c = std::abs(normal(random)) * 0.1f;
      for (std::size_t i = 0; i < k; ++i)
        for (std::size_t j = 0; j < k; ++j)
          for (std::size_t r = 0; r < rows; ++r) gram[i * k + j] += factors[r * k + i] * factors[r * k + j];
      const auto w = problem.solve(gram, k, linear);
      REQUIRE(w.size() == k);
      CHECK(std::accumulate(w.begin(), w.end(), 0.0f) == doctest::Approx(1).epsilon(1e-5));
      std::vector<float> gradient(linear);
      for (std::size_t i = 0; i < k; ++i)
        for (std::size_t j = 0; j < k; ++j) gradient[i] += 2 * gram[i * k + j] * w[j];
      const float least = *std::ranges::min_element(gradient), largest = *std::ranges::max_element(gram);
      for (std::size_t i = 0; i < k; ++i) {
        CHECK(w[i] >= 0);
        if (w[i] > 1e-3f) CHECK(gradient[i] - least < 0.02f * largest);  // KKT, to the step length at which it stops
      }
    }
}

TEST_CASE("a frame that is the mean of two samples gets half of each") {
  // Residuals +r and -r cancel in halves.
  const std::vector<float> gram{4, -4, -4, 4}, linear{0, 0};
  SimplexProblem problem(2);
  const auto w = problem.solve(gram, 2, linear);
  CHECK(w[0] == doctest::Approx(0.5f).epsilon(1e-3));
  CHECK(w[1] == doctest::Approx(0.5f).epsilon(1e-3));
}

TEST_CASE("without residuals the first candidate keeps everything") {
  const std::vector<float> gram(9, 0.0f), linear(3, 0.0f);
  SimplexProblem problem(3);
  const auto w = problem.solve(gram, 3, linear);
  CHECK(w[0] == 1.0f);
  CHECK(w[1] + w[2] == 0.0f);
}

// The projection once subtracted 1 from sums so large that it was lost, and then did not end.
TEST_CASE("costs of any size leave shares that add up to 1, most of them for the cheapest") {
  for (const float cost : {1e3f, 1e8f, 1e15f, 1e30f}) {
    std::vector<float> gram(24 * 24, 0.0f), linear(24, cost);
    for (std::size_t i = 0; i < 24; ++i) gram[25 * i] = 1;
    linear[5] = 0.999f * cost;
    SimplexProblem problem(24);
    const auto w = problem.solve(gram, 24, linear);
    CHECK(std::accumulate(w.begin(), w.end(), 0.0f) == doctest::Approx(1).epsilon(1e-5));
    for (std::size_t i = 0; i < 24; ++i) CHECK(w[i] <= w[5]);
  }
}

TEST_CASE("ridge regression about given shares: sums to 1, and no exchange between two shares lowers the cost") {
  constexpr std::size_t k = 24, stride = 32, cells = 60;
  std::mt19937 random(9);
  std::normal_distribution<float> normal;
  std::vector<float> residuals(k * cells), gram(k * stride), prices(k), before(k, 1.0f / k);
  for (float& value : residuals) value = normal(random);
  for (float& price : prices) price = 1 + std::abs(normal(random));
  for (std::size_t i = 0; i < k; ++i)
    for (std::size_t j = 0; j < k; ++j)
      for (std::size_t c = 0; c < cells; ++c)
        gram[i * stride + j] += residuals[i * cells + c] * residuals[j * cells + c];
  std::vector<float> w = before;
  RidgeProblem(k).solve(gram, stride, prices, w);
  CHECK(std::accumulate(w.begin(), w.end(), 0.0) == doctest::Approx(1).epsilon(1e-5));
  // At the minimum, half the gradient is the same for all shares.
  std::vector<double> gradient(k);
  for (std::size_t i = 0; i < k; ++i) {
    gradient[i] = double{prices[i]} * (double{w[i]} - double{before[i]});
    for (std::size_t j = 0; j < k; ++j) gradient[i] += double{gram[i * stride + j]} * double{w[j]};
  }
  for (std::size_t i = 1; i < k; ++i) CHECK(gradient[i] == doctest::Approx(gradient[0]).epsilon(1e-3));
  CHECK(*std::ranges::min_element(w) < 0);  // lies beside the samples
  std::vector<float> dear(k, 1e9f), same = before;
  RidgeProblem(k).solve(gram, stride, dear, same);
  for (std::size_t i = 0; i < k; ++i) CHECK(same[i] == doctest::Approx(before[i]).epsilon(1e-4));
}
