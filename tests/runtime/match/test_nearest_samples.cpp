#include "runtime/src/match/sample_search.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

using namespace lbea;

namespace {

struct Ranked {
  double distance;
  std::uint32_t sample;
  auto operator<=>(const Ranked&) const = default;
};

// Eq. 3 term by term, in double, sorted whole.
std::vector<Ranked> naive_lbea(std::span<const float> table, const Positions& e) {
  const std::size_t stride = e.planes[0].size();
  std::vector<Ranked> ranked;
  for (std::uint32_t s = 0; s < table.size() / (3 * stride); ++s) {
    double distance = 0;
    for (std::size_t j = 0; j < e.count; ++j) {
      const auto d = [&](std::size_t axis) {
        return double{e.planes[axis][j]} - double{table[(3 * s + axis) * stride + j]};
      };
      distance += std::hypot(d(0), d(1), d(2));
    }
    ranked.push_back({distance, s});
  }
  std::ranges::sort(ranked);
  return ranked;
}

}  // namespace

TEST_CASE("the best k of eq. 3 equal a naive scan, for every number of modes around a line of 16") {
  std::mt19937 random(4);
  std::normal_distribution<float> value(0, 100);
  for (const std::size_t modes : {1u, 2u, 15u, 16u, 17u, 100u})
    for (const std::size_t samples : {1u, 2u, 7u, 300u}) {
      CAPTURE(modes);
      CAPTURE(samples);
      Positions e(modes);
      std::vector<float> table(samples * 3 * e.planes[0].size());
      for (std::size_t s = 0; s < samples; ++s)
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (std::size_t j = 0; j < modes; ++j) table[(3 * s + axis) * e.planes[0].size() + j] = value(random);
      for (auto& plane : e.planes) std::generate_n(plane.begin(), modes, [&] { return value(random); });
      ReferenceView reference;
      reference.coefficients = table;
      const auto expected = naive_lbea(table, e);
      for (const std::uint32_t k : {1u, 3u, 5u}) {
        BestSamples best(std::min(k, static_cast<std::uint32_t>(samples)));
        search_lbea(reference, e, best);
        REQUIRE(best.ranked().size() == best.capacity());
        for (std::size_t i = 0; i < best.ranked().size(); ++i) {
          CHECK(best.ranked()[i].sample == expected[i].sample);
          CHECK(best.ranked()[i].distance == doctest::Approx(expected[i].distance).epsilon(1e-5));
        }
      }
    }
}

// Curves in time through the coefficients, as simulations are, some samples twice.
std::vector<float> curves(std::size_t samples, std::size_t modes, std::size_t stride, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<float> value(0, 1);
  std::vector<float> table(samples * 3 * stride), way(3 * stride);
  for (std::size_t s = 0; s < samples; ++s) {
    if (s % 31 == 0) std::ranges::generate(way, [&] { return value(random); });
    const std::size_t like = s > 40 && s % 17 == 0 ? s - 40 : s;
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t j = 0; j < modes; ++j) {
        const float decay = 1.0f / static_cast<float>(1 + j), noise = 0.02f * value(random);
        table[(3 * s + axis) * stride + j] = like == s
                                                 ? decay * (static_cast<float>(s % 31) * way[axis * stride + j] + noise)
                                                 : table[(3 * like + axis) * stride + j];
      }
  }
  return table;
}

TEST_CASE("the tree finds what a look at every sample finds, to the bit, whatever was found before") {
  for (const std::size_t modes : {1u, 16u, 100u})
    for (const std::size_t samples : {1u, 2u, 31u, 32u, 33u, 64u, 65u, 1'000u, 5'000u}) {
      CAPTURE(modes);
      CAPTURE(samples);
      Positions e(modes);
      const auto table = curves(samples, modes, e.planes[0].size(), static_cast<unsigned>(samples + modes));
      ReferenceView reference;
      reference.coefficients = table;
      const SampleTree tree(table, modes);
      std::mt19937 random(5);
      std::normal_distribution<float> value(0, 0.05f);
      for (const std::uint32_t k : {1u, 5u}) {
        BestSamples found(std::min(k, static_cast<std::uint32_t>(samples))),
            expected(static_cast<std::uint32_t>(found.capacity()));
        for (std::size_t query = 0; query < 40; ++query) {
          const std::size_t near = random() % samples;
          for (std::size_t axis = 0; axis < 3; ++axis)
            for (std::size_t j = 0; j < modes; ++j)
              e.planes[axis][j] = table[(3 * near + axis) * e.planes[0].size() + j] + (query % 4 == 0   ? 0.0f
                                                                                       : query % 4 == 3 ? 40.0f
                                                                                                        : 1.0f) *
                                                                                          value(random);
          search_lbea(reference, e, expected);
          tree.search(e, found);
          REQUIRE(found.ranked().size() == expected.ranked().size());
          for (std::size_t i = 0; i < found.ranked().size(); ++i) {
            CHECK(found.ranked()[i].sample == expected.ranked()[i].sample);
            CHECK(found.ranked()[i].distance == expected.ranked()[i].distance);
          }
        }
      }
    }
}

TEST_CASE("ties between samples go to the lower index") {
  Positions e(4);
  const std::vector<float> table(10 * 3 * e.planes[0].size());  // ten equal samples
  ReferenceView reference;
  reference.coefficients = table;
  BestSamples best(3);
  search_lbea(reference, e, best);
  for (std::uint32_t i = 0; i < 3; ++i) CHECK(best.ranked()[i].sample == i);
  SampleTree(table, 4).search(e, best);
  for (std::uint32_t i = 0; i < 3; ++i) CHECK(best.ranked()[i].sample == i);
}

TEST_CASE("the bound is the worst of a full list, and infinite before that") {
  BestSamples best(2);
  CHECK(std::isinf(best.bound()));
  best.offer(7, 3);
  CHECK(std::isinf(best.bound()));
  best.offer(8, 1);
  CHECK(best.bound() == 3);
  best.offer(9, 2);
  CHECK(best.bound() == 2);
  best.offer(10, 2);  // a tie: the earlier stays
  CHECK(best.ranked()[1].sample == 9);
  best.offer(11, std::nanf(""));
  CHECK(best.ranked()[0].sample == 8);
  CHECK(best.ranked()[1].sample == 9);
}

// A forged model whose numbers overflow once ended a matcher: no sample was near, and the nearest was asked for.
TEST_CASE("distances that no float can hold are the farthest, not absent") {
  BestSamples best(3);
  best.offer(4, std::numeric_limits<float>::infinity());
  best.offer(5, std::nanf(""));
  best.offer(6, 1e30f);
  REQUIRE(best.ranked().size() == 3);
  CHECK(best.ranked()[0].sample == 6);
  CHECK(best.ranked()[1].sample == 4);
  CHECK(best.ranked()[2].sample == 5);
  CHECK(std::isfinite(best.bound()));
}

TEST_CASE("samples selected without order are the best ones, those with equal distances by number") {
  std::mt19937 random(9);
  std::uniform_int_distribution<int> distance(0, 50);
  for (const std::uint32_t capacity : {1u, 8u, 256u})
    for (const std::uint32_t offered : {1u, 7u, 256u, 257u, 512u, 5'000u}) {
      SelectedSamples selected(capacity);
      BestSamples best(capacity);
      for (std::uint32_t i = 0; i < offered; ++i) {
        const auto d = static_cast<float>(distance(random));
        selected.offer(i, d);
        best.offer(i, d);
      }
      for (const std::size_t first : {0u, 3u}) {
        const auto found = selected.selected(first);
        const auto by_rank = [](const RankedSample& one) { return std::pair(one.distance, one.sample); };
        REQUIRE(found.size() == best.ranked().size());
        std::vector<RankedSample> ordered(found.begin(), found.end());
        if (first < ordered.size())
          std::ranges::sort(ordered.begin(), ordered.begin() + static_cast<std::ptrdiff_t>(first), {}, by_rank);
        for (std::size_t i = 0; i < std::min(first, ordered.size()); ++i)
          CHECK(by_rank(ordered[i]) == by_rank(best.ranked()[i]));
        std::ranges::sort(ordered, {}, by_rank);
        for (std::size_t i = 0; i < ordered.size(); ++i) CHECK(by_rank(ordered[i]) == by_rank(best.ranked()[i]));
      }
    }
}
