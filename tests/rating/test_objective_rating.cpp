// ISO/TS 18571: every score by hand, and all of them by an independent implementation (tests/data/rating/README.md).
#include "tests/support/refusals.hpp"
#include "tests/support/test_data.hpp"
#include "tools/shared/rating/objective_rating.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

using namespace lbea;
using namespace lbea::tool;
using namespace lbea::test;

namespace {

using Values = std::vector<double>;

template <class Function>
Values made(std::size_t size, Function function) {
  Values values;
  for (std::size_t i = 0; i < size; ++i) values.push_back(function(static_cast<double>(i)));
  return values;
}

/// Of 80 values, zero at both ends so that a shift changes nothing there.
Values pulse(double begin, double amplitude = 10) {
  return made(200, [=](double i) {
    const double phase = (i - begin) / 80;
    return phase > 0 && phase < 1 ? amplitude * std::pow(std::sin(phase * 3.14159265358979), 2) : 0;
  });
}

std::vector<std::string> row_of(std::istream& file) {
  std::string line, field;
  std::getline(file, line);
  std::istringstream fields(line);
  std::vector<std::string> row;
  while (std::getline(fields, field, ',')) row.push_back(field);
  return row;
}

struct StoredPair {
  Values reference, analyzed;
  explicit StoredPair(const std::string& name) {
    std::ifstream file(test::data() / "rating" / name);
    row_of(file);
    for (auto row = row_of(file); row.size() == 3; row = row_of(file)) {
      reference.push_back(std::stod(row[1]));
      analyzed.push_back(std::stod(row[2]));
    }
  }
};

constexpr double rounding = 1e-12;
doctest::Approx about(double value) { return doctest::Approx(value).epsilon(rounding); }

}  // namespace

TEST_CASE("a signal and its copy have the rating 1") {
  for (const Values& signal : {pulse(40), Values(9, 0.0), Values(50, -3.0), made(100, [](double i) { return i; })}) {
    const ObjectiveRating rating = rate({signal, signal});
    for (const double score : {rating.overall, rating.corridor, rating.phase, rating.magnitude, rating.slope})
      CHECK(score == about(1));
    CHECK(rating.shift.values == 0);
  }
}

TEST_CASE("corridors are 5 % and 50 % of the reference's largest magnitude, quadratic in between") {
  const Values reference{0, 0, 0, 0, 0, 0, 0, 0, -10};
  //                    inside, edge of the inner one, 1.0, 2.0, 3.5, edge of the outer one, outside, equal, equal
  const Values analyzed{0.49, 0.5, 1, -2, 3.5, 5, 5.1, 0, -10};
  const auto between = [](double difference) { return std::pow((5 - difference) / 4.5, 2); };
  CHECK(corridor_score({reference, analyzed}) ==
        about((1 + 1 + between(1) + between(2) + between(3.5) + 0 + 0 + 1 + 1) / 9));
}

TEST_CASE("a constant offset costs corridor and magnitude, not phase and slope") {
  const Values reference = made(100, [](double i) { return 10 * std::cos(i / 16); });
  Values analyzed = reference;
  for (double& value : analyzed) value += 2;
  const ObjectiveRating rating = rate({reference, analyzed});
  CHECK(rating.corridor == about(std::pow((5 - 2) / 4.5, 2)));
  CHECK(rating.phase == 1);
  CHECK(rating.slope == about(1));
  CHECK(rating.magnitude < 1);
  CHECK(rating.overall == about(0.4 * rating.corridor + 0.2 * (rating.phase + rating.magnitude + rating.slope)));
}

TEST_CASE("a pure shift by n values costs n of a fifth of the signal, in either direction") {
  const Values reference = pulse(60);
  for (const int by : {-40, -39, -7, -1, 0, 1, 12, 39, 40}) {
    const Values analyzed = pulse(60 + by);
    const ObjectiveRating rating = rate({reference, analyzed});
    CHECK(rating.shift.values == by);
    CHECK(rating.phase == about(1 - std::abs(by) / 40.0));
    CHECK(rating.magnitude == about(1));
    CHECK(rating.slope == about(1));
    const RatedPair aligned = without_shift({reference, analyzed}, rating.shift);
    for (std::size_t i = 0; i < aligned.reference.size(); ++i)
      CHECK(std::abs(aligned.reference[i] - aligned.analyzed[i]) < 1e-9);
  }
  CHECK(rate({reference, pulse(105)}).phase == 0);  // 45 late: only 40 are tried
}

TEST_CASE("of equally good shifts the smallest counts: straight lines, constants, periodic signals") {
  const Values line = made(150, [](double i) { return 3 * i - 7; }), slower = made(150, [](double i) { return i; });
  CHECK(phase_shift({line, slower}).values == 0);
  CHECK(phase_shift({Values(60, 2.0), Values(60, 3.0)}).values == 0);
  CHECK(phase_shift({line, Values(150, 3.0)}).values == 0);
  const auto wave = [](double late) { return made(200, [=](double i) { return std::fmod(i + 20 - late, 20); }); };
  CHECK(phase_shift({wave(0), wave(4)}).values == 4);  // 4 late is 16 early
}

TEST_CASE("warping joins each place to those of equal value") {
  const Values reference{0, 0, 0, 1, 2, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3};
  const Values analyzed{0, 0, 1, 2, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3, 3};
  const std::vector<JoinedPlaces> path = warped({reference, analyzed});
  CHECK((path.front().reference == 0 && path.front().analyzed == 0));
  CHECK((path.back().reference == 19 && path.back().analyzed == 19));
  for (std::size_t i = 0; i < path.size(); ++i) {
    CHECK(reference[path[i].reference] == analyzed[path[i].analyzed]);
    CHECK(std::max(path[i].reference, path[i].analyzed) - std::min(path[i].reference, path[i].analyzed) < 2);
    if (i == 0) continue;
    const std::size_t r = path[i].reference - path[i - 1].reference, a = path[i].analyzed - path[i - 1].analyzed;
    CHECK((r <= 1 && a <= 1 && r + a >= 1));
  }
  CHECK(magnitude_score({reference, analyzed}) == 1);
}

TEST_CASE("magnitude: the warped difference relative to the warped reference, 0 from a half on") {
  // Constant signals: warping cannot reduce the difference, which is a share of the reference in every pair.
  for (const double share : {0.0, 0.1, 0.25, 0.49}) {
    CHECK(magnitude_score({Values(30, 10.0), Values(30, 10 * (1 - share))}) == about(1 - share / 0.5));
    CHECK(magnitude_score({Values(30, -10.0), Values(30, -10 * (1 + share))}) == about(1 - share / 0.5));
  }
  CHECK(magnitude_score({Values(30, 10.0), Values(30, 15.0)}) == 0);
  CHECK(magnitude_score({Values(30, 10.0), Values(30, -10.0)}) == 0);
  CHECK(magnitude_score({Values(30, 0.0), Values(30, 0.0)}) == 1);
  CHECK(magnitude_score({Values(30, 0.0), Values(30, 1e-9)}) == 0);
}

TEST_CASE("slopes are central differences over 9 values, fewer at the ends") {
  const Values line = made(20, [](double i) { return 2.5 * i; });
  for (const double slope : smoothed_slopes(line)) CHECK(slope == about(2.5));
  Values step(20, 0.0);
  for (std::size_t i = 10; i < 20; ++i) step[i] = 18;  // central differences: 9 at 9 and 10
  const Values slopes = smoothed_slopes(step);
  for (std::size_t i = 0; i < 20; ++i) CHECK(slopes[i] == about(i == 5 || i == 14 ? 1 : i > 5 && i < 14 ? 2 : 0));
  Values end(12, 0.0);
  end[11] = 15;  // 7.5 at 10, 15 at 11
  CHECK(smoothed_slopes(end)[11] == about(15));
  CHECK(smoothed_slopes(end)[10] == about((7.5 + 15) / 3));
  CHECK(smoothed_slopes(end)[8] == about((7.5 + 15) / 7));
}

TEST_CASE("slope: the difference relative to the reference, 0 from twice on") {
  const auto line = [](double slope) { return made(40, [=](double i) { return slope * i + 5; }); };
  for (const double other : {-0.9, 0.0, 0.5, 1.0, 1.7, 2.9})
    CHECK(slope_score({line(1), line(other)}) == about(1 - std::abs(other - 1) / 2));
  CHECK(slope_score({line(1), line(-2)}) == 0);
  CHECK(slope_score({line(0), line(0)}) == 1);
  CHECK(slope_score({line(0), line(1)}) == 0);
}

TEST_CASE("an independent implementation gives the same scores") {
  std::ifstream expected(test::data() / "rating/expected.csv");
  REQUIRE(expected);
  row_of(expected);
  int pairs = 0;
  for (auto row = row_of(expected); row.size() == 7; row = row_of(expected), ++pairs) {
    const StoredPair pair(row[0]);
    const ObjectiveRating rating = rate({pair.reference, pair.analyzed});
    INFO(row[0]);
    CHECK(rating.corridor == about(std::stod(row[1])));
    CHECK(rating.phase == about(std::stod(row[2])));
    CHECK(rating.magnitude == about(std::stod(row[3])));
    CHECK(rating.slope == about(std::stod(row[4])));
    CHECK(rating.overall == about(std::stod(row[5])));
    CHECK(rating.shift.values == std::stol(row[6]));
  }
  CHECK(pairs == 7);
}

TEST_CASE("a rating has no unit") {
  const StoredPair pair("acceleration.csv");
  const ObjectiveRating rating = rate({pair.reference, pair.analyzed});
  for (const double factor : {1e-6, -1.0, 1e9}) {
    Values reference = pair.reference, analyzed = pair.analyzed;
    for (Values* values : {&reference, &analyzed})
      for (double& value : *values) value *= factor;
    CHECK(rate({reference, analyzed}).overall == about(rating.overall));
  }
}

TEST_CASE("the grades begin above 0.94, 0.80 and 0.58") {
  CHECK(grade_of(1) == "excellent");
  CHECK(grade_of(0.9401) == "excellent");
  CHECK(grade_of(0.94) == "good");
  CHECK(grade_of(0.80) == "fair");
  CHECK(grade_of(0.58) == "poor");
  CHECK(grade_of(0) == "poor");
}

TEST_CASE("signals that cannot be rated are refused") {
  Values with_nan(20, 1.0);
  with_nan[7] = std::numeric_limits<double>::quiet_NaN();
  CHECK_THROWS_WITH_AS(static_cast<void>(rate({Values(8, 1.0), Values(8, 1.0)})),
                       "a signal of fewer than 9 values cannot be rated", Error);
  CHECK_THROWS_WITH_AS(static_cast<void>(rate({Values(20, 1.0), Values(21, 1.0)})),
                       "signals of different sizes cannot be rated", Error);
  CHECK_THROWS_WITH_AS(static_cast<void>(rate({Values(20, 1.0), with_nan})),
                       "a signal with a value that is not finite cannot be rated", Error);
}
