// The check of answers: it accepts right answers and names the first error of a wrong one.
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

struct CheckedPlates : Plates {
  Answer answer = matcher_pipeline(model, config)->answer(frame);
  [[nodiscard]] std::string verdict() const {
    return AnswerCheck(task(), points).disagreement(answer).value_or("right");
  }
};

bool begins(const std::string& text, const std::string& with) { return text.starts_with(with); }

}  // namespace

TEST_CASE("a right answer passes") {
  const CheckedPlates plates;
  CHECK(plates.verdict() == "right");
  CHECK(plates.answer.ranked.size() == 5);
}

TEST_CASE("a farther point at one vertex is found, whichever vertex it is") {
  for (const std::size_t vertex : {std::size_t{0}, std::size_t{101}, std::size_t{199}}) {
    CheckedPlates plates;
    plates.answer.points.at(vertex) = (plates.answer.points[vertex] + 17) % 4'000;
    CHECK(begins(plates.verdict(), "vertex " + std::to_string(vertex) + ": point"));
  }
}

TEST_CASE("a point index that is too large and a point that is not finite are found") {
  CheckedPlates plates;
  plates.points[12].x = std::numeric_limits<float>::quiet_NaN();
  plates.answer.points[3] = 12;
  CHECK(begins(plates.verdict(), "vertex 3: point 12 is outside"));
  plates.answer.points[3] = 4'000;
  CHECK(begins(plates.verdict(), "vertex 3: point 4000 is not in the frame"));
  plates.answer.points.pop_back();
  CHECK(plates.verdict() == "199 nearest points for 200 vertices");
}

TEST_CASE("a wrong coefficient is found") {
  CheckedPlates plates;
  float& coefficient = plates.answer.coefficients.at(3 * 4 + 1);
  const float right = coefficient;
  coefficient = right + 1;
  CHECK(begins(plates.verdict(), "mode 4, coordinate 1: coefficient"));
  coefficient = std::numeric_limits<float>::quiet_NaN();
  CHECK(begins(plates.verdict(), "mode 4, coordinate 1: coefficient"));
  coefficient = right;
  CHECK(plates.verdict() == "right");
}

TEST_CASE("a wrong ranking is found: distance, order, sample, repeated sample, too few samples") {
  CheckedPlates plates;
  const std::vector<RankedSample> right = plates.answer.ranked;
  const auto verdict_with = [&](auto change) {
    plates.answer.ranked = right;
    change(plates.answer.ranked);
    return plates.verdict();
  };
  CHECK(begins(verdict_with([](auto& ranked) { ranked[1].distance *= 1.0001f; }), "place 2: sample"));
  CHECK(begins(verdict_with([](auto& ranked) { std::swap(ranked[0], ranked[4]); }), "place 1: sample"));
  CHECK(begins(verdict_with([](auto& ranked) {
                 ranked.erase(ranked.begin());
                 ranked.push_back(ranked.back());
               }),
               "place 1: sample"));
  CHECK(verdict_with([](auto& ranked) { ranked[3] = ranked[2]; }).ends_with("is ranked twice"));
  CHECK(verdict_with([](auto& ranked) { ranked[2].sample = 24; }) == "place 3: sample 24 is not in the model");
  CHECK(verdict_with([](auto& ranked) { ranked.pop_back(); }) == "4 samples ranked, should be 5");
  CHECK(verdict_with([](auto&) {}) == "right");
}

TEST_CASE("a wrong reference is found") {
  CheckedPlates plates;
  plates.answer.reference = 1;
  CHECK(plates.verdict() == "reference 1 is not in the model");
}
