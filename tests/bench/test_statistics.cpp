// Percentiles of sequences whose percentiles are known.
#include "tools/bench/measurement.hpp"
#include "tools/bench/round_trip.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <numeric>
#include <random>
#include <vector>

using namespace lbea::tool::bench;

namespace {

std::vector<double> one_to(std::size_t count) {
  std::vector<double> values(count);
  std::iota(values.begin(), values.end(), 1.0);
  return values;
}

// The definition, by counting.
double by_definition(const std::vector<double>& values, double share) {
  std::vector<double> candidates = values;
  std::ranges::sort(candidates);
  for (const double candidate : candidates) {
    const auto not_above = std::ranges::count_if(values, [candidate](double v) { return v <= candidate; });
    if (static_cast<double>(not_above) >= share * static_cast<double>(values.size()) - 1e-9) return candidate;
  }
  return candidates.back();
}

}  // namespace

TEST_CASE("no values: all zero") {
  const Statistics s = statistics_of({});
  CHECK(s.count == 0);
  CHECK((s.p50 == 0 && s.p90 == 0 && s.p99 == 0 && s.p99_9 == 0 && s.max == 0 && s.mean == 0));
}

TEST_CASE("one value is every percentile") {
  const std::vector<double> values{7};
  const Statistics s = statistics_of(values);
  CHECK(s.count == 1);
  for (const double value : {s.p50, s.p90, s.p99, s.p99_9, s.max, s.mean}) CHECK(value == 7);
}

TEST_CASE("of two values the median is the lower one, all above it the higher one") {
  const std::vector<double> values{9, 4};
  const Statistics s = statistics_of(values);
  CHECK(s.p50 == 4);
  for (const double value : {s.p90, s.p99, s.p99_9, s.max}) CHECK(value == 9);
  CHECK(s.mean == 6.5);
}

TEST_CASE("1 to 1000: the percentile is its own rank") {
  std::vector<double> values = one_to(1000);
  std::ranges::shuffle(values, std::mt19937(3));
  const Statistics s = statistics_of(values);
  CHECK(s.p50 == 500);
  CHECK(s.p90 == 900);
  CHECK(s.p99 == 990);
  CHECK(s.p99_9 == 999);
  CHECK(s.max == 1000);
  CHECK(s.mean == 500.5);
}

TEST_CASE("below 1000 values p99.9 is the largest, from 1001 on the largest but one") {
  CHECK(statistics_of(one_to(999)).p99_9 == 999);
  CHECK(statistics_of(one_to(1001)).p99_9 == 1000);
  CHECK(statistics_of(one_to(2000)).p99_9 == 1998);
}

TEST_CASE("ties are counted one by one") {
  std::vector<double> values(89, 1.0);
  values.resize(99, 2.0);
  values.push_back(50);
  const Statistics s = statistics_of(values);
  CHECK(s.p50 == 1);
  CHECK(s.p90 == 2);
  CHECK(s.p99 == 2);
  CHECK(s.p99_9 == 50);
}

TEST_CASE("any sequence agrees with the definition") {
  std::mt19937 random(4);
  for (const std::size_t count : {3u, 10u, 11u, 100u, 101u, 1'234u}) {
    std::vector<double> values(count);
    for (double& value : values) value = static_cast<double>(random() % 200);
    CAPTURE(count);
    const Statistics s = statistics_of(values);
    CHECK(s.p50 == by_definition(values, 0.5));
    CHECK(s.p90 == by_definition(values, 0.9));
    CHECK(s.p99 == by_definition(values, 0.99));
    CHECK(s.p99_9 == by_definition(values, 0.999));
  }
}

TEST_CASE("a histogram counts every value once, in its bucket, without gaps between buckets") {
  std::mt19937 random(9);
  std::lognormal_distribution<double> time(7, 1);
  std::vector<double> values(2'000);
  for (double& value : values) value = time(random);
  values.push_back(1 << 20);
  const auto buckets = histogram_of(values);
  std::size_t counted = 0;
  for (std::size_t i = 0; i < buckets.size(); ++i) {
    const double above = i == 0 ? 0 : buckets[i - 1].up_to;
    CHECK(buckets[i].count == static_cast<std::size_t>(std::ranges::count_if(
                                  values, [&](double v) { return v > above && v <= buckets[i].up_to; })));
    if (i > 0) CHECK(buckets[i].up_to == doctest::Approx(above * 1.41421356).epsilon(1e-6));
    counted += buckets[i].count;
  }
  CHECK(counted == values.size());
  CHECK(histogram_of({}).empty());
}
