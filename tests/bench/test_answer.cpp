// The check before the clock: it accepts every right answer and names what is wrong with a wrong one.
#include "tests/bench/plates.hpp"

#include <doctest/doctest.h>

#include <limits>
#include <string>

using namespace lbea;
using namespace lbea::bake;
using namespace lbea::tool;
using namespace lbea::tool::bench;
using lbea::test::Plates;

namespace {

struct Judged : Plates {
  Answer answer = matcher_pipeline(model, config)->answer(frame);
  [[nodiscard]] std::string judge() const { return Judge(question(), points).disagreement(answer).value_or("right"); }
};

bool begins(const std::string& text, const std::string& with) { return text.starts_with(with); }

}  // namespace

TEST_CASE("a right answer passes") {
  const Judged plates;
  CHECK(plates.judge() == "right");
  CHECK(plates.answer.ranked.size() == 5);
}

TEST_CASE("a farther point at one vertex is found, whichever vertex it is") {
  for (const std::size_t vertex : {std::size_t{0}, std::size_t{101}, std::size_t{199}}) {
    Judged plates;
    plates.answer.points.at(vertex) = (plates.answer.points[vertex] + 17) % 4'000;
    CHECK(begins(plates.judge(), "vertex " + std::to_string(vertex) + ": point"));
  }
}

TEST_CASE("a point that is not there or not a number is found") {
  Judged plates;
  plates.points[12].x = std::numeric_limits<float>::quiet_NaN();
  plates.answer.points[3] = 12;
  CHECK(begins(plates.judge(), "vertex 3: point 12 is outside"));
  plates.answer.points[3] = 4'000;
  CHECK(begins(plates.judge(), "vertex 3: point 4000 is not in the frame"));
  plates.answer.points.pop_back();
  CHECK(plates.judge() == "199 nearest points for 200 vertices");
}

TEST_CASE("a wrong coefficient is found") {
  Judged plates;
  float& coefficient = plates.answer.coefficients.at(3 * 4 + 1);
  const float right = coefficient;
  coefficient = right + 1;
  CHECK(begins(plates.judge(), "mode 4, coordinate 1: coefficient"));
  coefficient = std::numeric_limits<float>::quiet_NaN();
  CHECK(begins(plates.judge(), "mode 4, coordinate 1: coefficient"));
  coefficient = right;
  CHECK(plates.judge() == "right");
}

TEST_CASE("a wrong ranking is found: distance, order, sample, twice the same, too few") {
  Judged plates;
  const std::vector<RankedSample> right = plates.answer.ranked;
  const auto judged_with = [&](auto change) {
    plates.answer.ranked = right;
    change(plates.answer.ranked);
    return plates.judge();
  };
  CHECK(begins(judged_with([](auto& ranked) { ranked[1].distance *= 1.0001f; }), "place 2: sample"));
  CHECK(begins(judged_with([](auto& ranked) { std::swap(ranked[0], ranked[4]); }), "place 1: sample"));
  CHECK(begins(judged_with([](auto& ranked) {
                 ranked.erase(ranked.begin());
                 ranked.push_back(ranked.back());
               }),
               "place 1: sample"));
  CHECK(judged_with([](auto& ranked) { ranked[3] = ranked[2]; }).ends_with("is ranked twice"));
  CHECK(judged_with([](auto& ranked) { ranked[2].sample = 24; }) == "place 3: sample 24 is not in the model");
  CHECK(judged_with([](auto& ranked) { ranked.pop_back(); }) == "4 samples ranked, should be 5");
  CHECK(judged_with([](auto&) {}) == "right");
}

TEST_CASE("a wrong reference is found") {
  Judged plates;
  plates.answer.reference = 1;
  CHECK(plates.judge() == "reference 1 is not in the model");
}
